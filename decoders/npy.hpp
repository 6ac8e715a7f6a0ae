// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "container/byte_sink.hpp"

namespace relit::decoders {

/// Writes one C-ordered NumPy array (.npy, version 1.0), a piece at a time, beside its target;
/// commit() renames it into place, and a writer destroyed without commit() leaves nothing behind.
class NpyWriter {
 public:
  enum class Type { kFloat32, kUint8 };

  /// Errors: kIo (names the path and the system's reason), kInvalid for an empty shape.
  static Result<NpyWriter> create(const std::filesystem::path& path, Type type,
                                  std::span<const std::uint64_t> shape);

  /// The next elements, in order. Errors: kIo (disk full), kInvalid for more than the shape holds
  /// or another type.
  Status write(std::span<const float> values);
  Status write(std::span<const std::uint8_t> values);
  /// Errors: kInvalid when elements are missing, kIo.
  Status commit();

 private:
  NpyWriter() = default;
  Status write_elements(std::span<const std::uint8_t> bytes, std::uint64_t elements, Type type);

  std::string target_;
  std::unique_ptr<container::FileSink> sink_;
  Type type_ = Type::kFloat32;
  std::uint64_t remaining_ = 0;
};

/// Reads a C-ordered float32 or uint8 array, any part of it at a time. Values of uint8 arrays
/// become floats.
class NpyReader {
 public:
  /// Errors: kIo, kCorrupt, kTruncated where the file is not as long as its shape says,
  /// kUnsupported (another type or Fortran order), kLimit.
  static Result<NpyReader> open(const std::filesystem::path& path);

  [[nodiscard]] const std::vector<std::uint64_t>& shape() const { return shape_; }
  [[nodiscard]] std::uint64_t elements() const { return elements_; }
  /// The elements from `first` on. Errors: kIo, kInvalid beyond the end.
  Status read(std::uint64_t first, std::span<float> out);

 private:
  using File = std::unique_ptr<std::FILE, void (*)(std::FILE*)>;
  NpyReader(File file, std::string name) : file_(std::move(file)), name_(std::move(name)) {}
  Status read_header();
  [[nodiscard]] Unexpected io_error() const;

  File file_;
  std::string name_;
  std::vector<std::uint64_t> shape_;
  std::uint64_t elements_ = 0, header_bytes_ = 0;
  bool bytes_ = false;
};

/// An array read whole.
struct NpyArray {
  std::vector<std::uint64_t> shape;
  std::vector<float> values;
};

/// Errors: as NpyReader::open().
Result<NpyArray> read_npy(const std::filesystem::path& path);

}  // namespace relit::decoders
