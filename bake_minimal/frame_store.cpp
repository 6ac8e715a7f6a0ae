// SPDX-License-Identifier: MIT
#include "bake_minimal/frame_store.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cassert>
#include <cstring>
#include <string>
#include <utility>

namespace relit::bake {

Result<FrameStore> FrameStore::create(const std::filesystem::path& directory, std::uint64_t frames,
                                      std::size_t floats_per_frame) {
  FrameStore store;
  store.frames_ = frames;
  store.floats_ = floats_per_frame;
  store.bytes_ = frames * floats_per_frame * sizeof(float);
  const std::filesystem::path folder = directory.empty() ? "." : directory;
  std::string name = (folder / ".relit-bake-XXXXXX").string();
  const int file = ::mkstemp(name.data());
  if (file < 0) {
    return fail(ErrorCode::kIo, folder.string() + ": cannot be written: " + std::strerror(errno));
  }
  ::unlink(name.c_str());
  // Asking for the blocks now turns a full disk into an error here rather than a SIGBUS later.
  const int full = ::posix_fallocate(file, 0, static_cast<off_t>(store.bytes_));
  void* map = full == 0 ? ::mmap(nullptr, store.bytes_, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0)
                        : MAP_FAILED;
  const int reason = full != 0 ? full : errno;
  ::close(file);
  if (map == MAP_FAILED) {
    return fail(ErrorCode::kIo, folder.string() + ": no room for " +
                                    std::to_string(store.bytes_ >> 20) +
                                    " MiB of unquantised frames: " + std::strerror(reason));
  }
  store.data_ = static_cast<float*>(map);
  return store;
}

FrameStore::FrameStore(FrameStore&& other) noexcept { *this = std::move(other); }

FrameStore& FrameStore::operator=(FrameStore&& other) noexcept {
  std::swap(data_, other.data_);
  std::swap(bytes_, other.bytes_);
  std::swap(frames_, other.frames_);
  std::swap(floats_, other.floats_);
  return *this;
}

FrameStore::~FrameStore() {
  if (data_ != nullptr) ::munmap(data_, bytes_);
}

std::span<float> FrameStore::frame(std::uint64_t index) {
  assert(index < frames_);
  return {data_ + index * floats_, floats_};
}

std::span<const float> FrameStore::frame(std::uint64_t index) const {
  assert(index < frames_);
  return {data_ + index * floats_, floats_};
}

}  // namespace relit::bake
