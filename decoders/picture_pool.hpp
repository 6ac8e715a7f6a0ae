// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

struct AVCodecContext;
struct AVFrame;

/// Where libavcodec's pictures live, so that what a decoder holds is known (design, section 5).
namespace relit::decoders {

/// Where the memory of pictures comes from. Called from any thread.
struct PictureAllocator {
  void* user = nullptr;
  /// Null: out of memory. `alignment` is a power of two.
  void* (*allocate)(void* user, std::size_t bytes, std::size_t alignment) = nullptr;
  void (*release)(void* user, void* memory, std::size_t bytes) = nullptr;
};

/// Counts the bytes of pictures' buffers, of one decoder or of several, and gets them. Any thread.
class PictureMemory {
 public:
  PictureMemory() = default;
  /// Both functions are set, and can be called as long as a picture is left.
  explicit PictureMemory(const PictureAllocator& allocator) : allocator_(allocator) {}

  /// Null: out of memory. Aligned as libavcodec's code asks.
  [[nodiscard]] std::uint8_t* allocate(std::size_t bytes) const;
  void release(std::uint8_t* memory, std::size_t bytes) const;

  void add(std::size_t bytes);
  void remove(std::size_t bytes) { bytes_.fetch_sub(bytes, std::memory_order_relaxed); }
  [[nodiscard]] std::size_t bytes() const { return bytes_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::size_t peak_bytes() const { return peak_.load(std::memory_order_relaxed); }

 private:
  PictureAllocator allocator_;
  std::atomic<std::size_t> bytes_{0};
  std::atomic<std::size_t> peak_{0};
};

/// The samples of a picture in one buffer.
struct PictureLayout {
  int linesize[4] = {};
  std::size_t offset[4] = {};  ///< of each plane that the format has
  int planes = 0;
  std::size_t bytes = 0;  ///< in all, 0: no picture of this pool
};

/// What a decoder needs for pictures of its present pixel format and of this size, with the
/// alignment and the room behind the samples that its code may touch.
[[nodiscard]] PictureLayout picture_layout(AVCodecContext& context, int width, int height);

/// Buffers of one decoder's pictures: those that come back are used again. A buffer keeps its pool
/// alive, so that pictures outlive the decoder. Any thread.
class PicturePool : public std::enable_shared_from_this<PicturePool> {
 public:
  /// Also counts in `memory`, and gets its own from there, where that is not null.
  explicit PicturePool(std::shared_ptr<PictureMemory> memory) : shared_(std::move(memory)) {}
  ~PicturePool();
  PicturePool(const PicturePool&) = delete;
  PicturePool& operator=(const PicturePool&) = delete;

  /// For AVCodecContext::get_buffer2. Returns 0 or FFmpeg's error.
  int get_buffer(AVCodecContext& context, AVFrame& frame, int flags);

  /// Bytes of all buffers, in use or waiting for it.
  [[nodiscard]] const PictureMemory& memory() const { return own_; }
  /// Of one picture, as the decoder asked last; 0: not yet.
  [[nodiscard]] std::size_t picture_bytes() const;

 private:
  struct Block {
    std::shared_ptr<PicturePool> pool;  ///< while in use
    std::uint8_t* data = nullptr;
    std::size_t bytes = 0;
  };

  static void give_back(void* block, std::uint8_t* data);
  [[nodiscard]] Block* take(std::size_t bytes);
  void destroy(Block* block);
  [[nodiscard]] const PictureMemory& source() const { return shared_ ? *shared_ : own_; }

  mutable std::mutex mutex_;
  std::vector<Block*> free_;
  std::size_t block_bytes_ = 0;  ///< of all blocks but those that are still out from before
  PictureMemory own_;
  std::shared_ptr<PictureMemory> shared_;
};

}  // namespace relit::decoders
