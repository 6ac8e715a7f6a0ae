// SPDX-License-Identifier: MIT
#include "decoders/picture_pool.hpp"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/frame.h>
#include <libavutil/imgutils.h>
#include <libavutil/pixdesc.h>
}

#include <cstring>
#include <new>

namespace relit::decoders {
namespace {

/// The widest vectors that libavcodec's code uses.
constexpr std::size_t kAlignment = 64;
/// What that code may read or write behind a plane, as avcodec_default_get_buffer2() leaves it.
constexpr std::size_t kBehindPlane = 16 + kAlignment - 1;

std::size_t aligned(std::size_t bytes) { return (bytes + kAlignment - 1) & ~(kAlignment - 1); }

}  // namespace

void PictureMemory::add(std::size_t bytes) {
  const std::size_t now = bytes_.fetch_add(bytes, std::memory_order_relaxed) + bytes;
  std::size_t peak = peak_.load(std::memory_order_relaxed);
  while (peak < now && !peak_.compare_exchange_weak(peak, now, std::memory_order_relaxed)) {
  }
}

std::uint8_t* PictureMemory::allocate(std::size_t bytes) const {
  if (allocator_.allocate != nullptr)
    return static_cast<std::uint8_t*>(allocator_.allocate(allocator_.user, bytes, kAlignment));
  return static_cast<std::uint8_t*>(
      ::operator new (bytes, std::align_val_t{kAlignment}, std::nothrow));
}

void PictureMemory::release(std::uint8_t* memory, std::size_t bytes) const {
  if (allocator_.release != nullptr)
    allocator_.release(allocator_.user, memory, bytes);
  else
    ::operator delete (memory, std::align_val_t{kAlignment});
}

PictureLayout picture_layout(AVCodecContext& context, int width, int height) {
  const auto pixel = context.pix_fmt;
  const AVPixFmtDescriptor* format = av_pix_fmt_desc_get(pixel);
  constexpr std::uint64_t kForeign =
      AV_PIX_FMT_FLAG_PAL | AV_PIX_FMT_FLAG_BITSTREAM | AV_PIX_FMT_FLAG_HWACCEL;
  if (format == nullptr || (format->flags & kForeign) != 0) return {};
  int stride_align[AV_NUM_DATA_POINTERS] = {};
  avcodec_align_dimensions2(&context, &width, &height, stride_align);
  PictureLayout layout;
  // Every plane's lines are aligned only where the width has enough factors of 2.
  for (bool fits = false; !fits;) {
    if (av_image_fill_linesizes(layout.linesize, pixel, width) < 0) return {};
    width += width & ~(width - 1);
    fits = true;
    for (int i = 0; i < 4; ++i) fits = fits && layout.linesize[i] % stride_align[i] == 0;
  }
  std::ptrdiff_t strides[4];
  for (int i = 0; i < 4; ++i) strides[i] = layout.linesize[i];
  std::size_t sizes[4];
  if (av_image_fill_plane_sizes(sizes, pixel, height, strides) < 0) return {};
  for (int i = 0; i < 4 && sizes[i] > 0; ++i) {
    layout.offset[i] = layout.bytes;
    layout.bytes += aligned(sizes[i] + kBehindPlane);
    ++layout.planes;
  }
  return layout;
}

PicturePool::~PicturePool() {
  for (Block* block : free_) destroy(block);
}

void PicturePool::destroy(Block* block) {
  own_.remove(block->bytes);
  if (shared_) shared_->remove(block->bytes);
  source().release(block->data, block->bytes);
  delete block;
}

std::size_t PicturePool::picture_bytes() const {
  const std::lock_guard lock(mutex_);
  return block_bytes_;
}

PicturePool::Block* PicturePool::take(std::size_t bytes) {
  {
    const std::lock_guard lock(mutex_);
    if (bytes != block_bytes_) {
      for (Block* block : free_) destroy(block);
      free_.clear();
      block_bytes_ = bytes;
    }
    if (!free_.empty()) {
      Block* block = free_.back();
      free_.pop_back();
      return block;
    }
  }
  std::uint8_t* data = source().allocate(bytes);
  if (data == nullptr) return nullptr;
  auto* block = new (std::nothrow) Block;
  if (block == nullptr) {
    source().release(data, bytes);
    return nullptr;
  }
  // What a damaged picture leaves out is not what was in memory before.
  std::memset(data, 0, bytes);
  block->data = data;
  block->bytes = bytes;
  own_.add(bytes);
  if (shared_) shared_->add(bytes);
  return block;
}

void PicturePool::give_back(void* opaque, std::uint8_t*) {
  auto* block = static_cast<Block*>(opaque);
  const std::shared_ptr<PicturePool> pool = std::move(block->pool);
  const std::lock_guard lock(pool->mutex_);
  if (block->bytes == pool->block_bytes_) {
    try {
      pool->free_.push_back(block);
      return;
    } catch (const std::bad_alloc&) {
    }
  }
  pool->destroy(block);
}

int PicturePool::get_buffer(AVCodecContext& context, AVFrame& frame, int flags) {
  const PictureLayout layout = picture_layout(context, frame.width, frame.height);
  if (layout.bytes == 0) return avcodec_default_get_buffer2(&context, &frame, flags);
  Block* block = take(layout.bytes);
  if (block == nullptr) return AVERROR(ENOMEM);
  block->pool = shared_from_this();
  frame.buf[0] = av_buffer_create(block->data, block->bytes, give_back, block, 0);
  if (frame.buf[0] == nullptr) {
    give_back(block, block->data);
    return AVERROR(ENOMEM);
  }
  for (int i = 0; i < layout.planes; ++i) {
    frame.data[i] = block->data + layout.offset[i];
    frame.linesize[i] = layout.linesize[i];
  }
  frame.extended_data = frame.data;
  return 0;
}

}  // namespace relit::decoders
