// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
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

/// A float32 or uint8 array read whole. Values of uint8 arrays become floats.
struct NpyArray {
  std::vector<std::uint64_t> shape;
  std::vector<float> values;
};

/// Errors: kIo, kCorrupt, kUnsupported (another type or Fortran order), kLimit.
Result<NpyArray> read_npy(const std::filesystem::path& path);

}  // namespace relit::decoders
