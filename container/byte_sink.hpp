// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "container/base/result.hpp"

namespace relit::container {

/// Where a Writer puts its bytes, front to back. One thread at a time.
class ByteSink {
 public:
  virtual ~ByteSink() = default;
  /// Takes all of `bytes` or fails. After a failure the sink takes nothing more. Errors: kIo.
  virtual Status write(std::span<const std::uint8_t> bytes) = 0;
};

/// Bytes in memory.
class MemorySink final : public ByteSink {
 public:
  Status write(std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] const std::vector<std::uint8_t>& bytes() const { return bytes_; }
  [[nodiscard]] std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// A file that appears under its name only when it is complete: it is written beside the target
/// under a temporary name, and takes the target's place in commit(). Without commit() nothing is
/// left behind and a file of that name stays as it was. A symbolic link is followed; a target that
/// exists and is not a regular file (a pipe, a device) is written directly.
class FileSink final : public ByteSink {
 public:
  /// Errors: kIo with the system's reason: the directory is missing or not writable, the target is
  /// a directory, …
  static Result<std::unique_ptr<FileSink>> create(const std::string& path);
  ~FileSink() override;
  FileSink(const FileSink&) = delete;
  FileSink& operator=(const FileSink&) = delete;

  Status write(std::span<const std::uint8_t> bytes) override;

  /// Writes what is buffered, waits until it is on the disk, and renames. Once. Errors: kIo; then
  /// the temporary file is gone and the target as it was.
  Status commit();

 private:
  FileSink(int descriptor, std::string target, std::string temporary);
  Status flush();
  Status write_through(std::span<const std::uint8_t> bytes);
  Status fail_and_discard(const std::string& doing, int error);
  void discard();

  int descriptor_;
  std::string target_;
  std::string temporary_;  ///< empty: the target is written directly
  std::vector<std::uint8_t> buffer_;
};

}  // namespace relit::container
