// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
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
};

/// A file, or standard input. Pipes, sockets and devices are read too, but cannot be sought in.
class FileSource final : public ByteSource {
 public:
  /// Opens `path`; "-" is standard input, which is treated as a pipe whatever it is and stays open.
  /// Errors: kIo with the system's reason, for directories too.
  static Result<std::unique_ptr<FileSource>> open(const std::string& path);
  ~FileSource() override;
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;

  Result<std::size_t> read(std::span<std::uint8_t> out) override;
  [[nodiscard]] std::optional<std::uint64_t> size() const override { return size_; }
  [[nodiscard]] bool seekable() const override { return size_.has_value(); }
  Status seek(std::uint64_t offset_bytes) override;

 private:
  FileSource(int descriptor, bool owned, std::string name, std::optional<std::uint64_t> size)
      : descriptor_(descriptor), owned_(owned), name_(std::move(name)), size_(size) {}

  int descriptor_;
  bool owned_;
  std::string name_;
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

}  // namespace relit::container
