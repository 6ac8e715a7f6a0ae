// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "container/base/result.hpp"

namespace relit::container {

/// Where a Reader gets its bytes. One thread at a time.
class ByteSource {
 public:
  virtual ~ByteSource() = default;

  /// Reads up to out.size() bytes (> 0) from the current position. Returns how many; fewer than
  /// asked for does not mean the end, 0 does. Errors: kIo, kCancelled.
  virtual Result<std::size_t> read(std::span<std::uint8_t> out) = 0;

  /// Bytes in all, where that is known.
  [[nodiscard]] virtual std::optional<std::uint64_t> size() const { return std::nullopt; }

  /// Whether seek() works, backwards too.
  [[nodiscard]] virtual bool seekable() const { return false; }

  /// Makes `offset_bytes` from the start the current position. Errors: kIo; kUnsupported if not
  /// seekable.
  virtual Status seek(std::uint64_t offset_bytes);

  /// Says that the bytes [begin, end) will be read next and that those behind them may never be, so
  /// that a source that fetches ranges fetches no more. Only a hint: everything can be read and
  /// sought all the same. Each call replaces the one before.
  virtual void expect(std::uint64_t begin_bytes, std::uint64_t end_bytes);
};

/// A file, or standard input. Pipes, sockets and devices are read too, but cannot be sought in.
class FileSource final : public ByteSource {
 public:
  /// Opens `path`; "-" is standard input, which is treated as a pipe whatever it is and stays open.
  /// A named pipe need not have a writer yet. `interrupt` is polled at least every 100 ms while
  /// what is no regular file has nothing to read, by the thread that reads; true: read() gives
  /// kCancelled. Errors: kIo with the system's reason, for directories too.
  static Result<std::unique_ptr<FileSource>> open(const std::string& path,
                                                  std::function<bool()> interrupt = {});
  ~FileSource() override;
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;

  Result<std::size_t> read(std::span<std::uint8_t> out) override;
  [[nodiscard]] std::optional<std::uint64_t> size() const override { return size_; }
  [[nodiscard]] bool seekable() const override { return size_.has_value(); }
  Status seek(std::uint64_t offset_bytes) override;

 private:
  FileSource(int descriptor, bool owned, std::string name, std::function<bool()> interrupt)
      : descriptor_(descriptor),
        owned_(owned),
        name_(std::move(name)),
        interrupt_(std::move(interrupt)) {}
  Status wait_for_bytes() const;

  int descriptor_;
  bool owned_;
  std::string name_;
  std::function<bool()> interrupt_;
  std::optional<std::uint64_t> size_;  ///< regular files only
};

/// Bytes in memory.
class MemorySource final : public ByteSource {
 public:
  /// Reads bytes that the caller keeps alive.
  explicit MemorySource(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  /// Owns its bytes.
  explicit MemorySource(std::vector<std::uint8_t> bytes)
      : owned_(std::move(bytes)), bytes_(owned_) {}
  MemorySource(const MemorySource&) = delete;
  MemorySource& operator=(const MemorySource&) = delete;

  Result<std::size_t> read(std::span<std::uint8_t> out) override;
  [[nodiscard]] std::optional<std::uint64_t> size() const override { return bytes_.size(); }
  [[nodiscard]] bool seekable() const override { return true; }
  Status seek(std::uint64_t offset_bytes) override;

 private:
  std::vector<std::uint8_t> owned_;
  std::span<const std::uint8_t> bytes_;
  std::size_t position_ = 0;
};

/// A source that a host implements in C. All functions are called from the thread that uses the
/// source, never two at once.
struct SourceCallbacks {
  void* user = nullptr;  ///< handed to every function
  /// Writes 1 to `bytes` (> 0) bytes to `out` and returns how many; 0 at the end; on failure an
  /// ErrorCode negated: -1 for I/O, -10 where the host asked to stop. Must not be null.
  std::int64_t (*read)(void* user, std::uint8_t* out, std::size_t bytes) = nullptr;
  /// Makes `offset_bytes` the current position and returns 0, or an ErrorCode negated. Null: the
  /// source only goes forward.
  int (*seek)(void* user, std::uint64_t offset_bytes) = nullptr;
  /// Bytes in all; negative: unknown, as where it is null.
  std::int64_t (*size)(void* user) = nullptr;
  /// ByteSource::expect(). May be null.
  void (*expect)(void* user, std::uint64_t begin_bytes, std::uint64_t end_bytes) = nullptr;
  /// Called once, when the source is destroyed. May be null.
  void (*close)(void* user) = nullptr;
};

/// Bytes from a host's callbacks.
class CallbackSource final : public ByteSource {
 public:
  /// Takes over `callbacks.user`: close() is called also where this fails. Errors: kInvalid for a
  /// null read().
  static Result<std::unique_ptr<CallbackSource>> open(const SourceCallbacks& callbacks);
  ~CallbackSource() override;
  CallbackSource(const CallbackSource&) = delete;
  CallbackSource& operator=(const CallbackSource&) = delete;

  Result<std::size_t> read(std::span<std::uint8_t> out) override;
  [[nodiscard]] std::optional<std::uint64_t> size() const override;
  [[nodiscard]] bool seekable() const override { return callbacks_.seek != nullptr; }
  Status seek(std::uint64_t offset_bytes) override;
  void expect(std::uint64_t begin_bytes, std::uint64_t end_bytes) override;

 private:
  explicit CallbackSource(const SourceCallbacks& callbacks) : callbacks_(callbacks) {}

  SourceCallbacks callbacks_;
};

}  // namespace relit::container
