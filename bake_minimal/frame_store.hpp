// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "container/base/result.hpp"

namespace relit::bake {

/// Frames of floats of one length, in a nameless temporary file that is mapped into memory, so that
/// a long clip at a large size needs disk and not memory. Coding needs the whole clip twice: once
/// for its range, once for its planes.
class FrameStore {
 public:
  /// Makes room for `frames` frames in `directory`. Errors: kIo with the bytes needed (disk full).
  static Result<FrameStore> create(const std::filesystem::path& directory, std::uint64_t frames,
                                   std::size_t floats_per_frame);
  FrameStore(FrameStore&& other) noexcept;
  FrameStore& operator=(FrameStore&& other) noexcept;
  ~FrameStore();

  [[nodiscard]] std::span<float> frame(std::uint64_t index);
  [[nodiscard]] std::span<const float> frame(std::uint64_t index) const;
  [[nodiscard]] std::uint64_t frames() const { return frames_; }

 private:
  FrameStore() = default;
  float* data_ = nullptr;
  std::size_t bytes_ = 0;
  std::uint64_t frames_ = 0;
  std::size_t floats_ = 0;
};

}  // namespace relit::bake
