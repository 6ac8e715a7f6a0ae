// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <memory>
#include <thread>
#include <vector>

#include "player/clip_reader.hpp"
#include "player/prefetcher.hpp"
#include "tests/player/files.hpp"
#include "tests/test.hpp"

/// Clips played by a Prefetcher, and what they are compared with.
namespace relit::player::test {

using Bytes = std::vector<std::uint8_t>;

/// Frames are not shown before all their planes have come.
inline PrefetchOptions patient() {
  PrefetchOptions options;
  options.impatient = false;
  return options;
}

/// Bytes that can only be read forward, as from a pipe.
class PipeSource final : public container::ByteSource {
 public:
  explicit PipeSource(Bytes bytes) : inner_(std::move(bytes)) {}
  Result<std::size_t> read(std::span<std::uint8_t> out) override {
    return inner_.read(out.first(std::min<std::size_t>(out.size(), 1000)));
  }

 private:
  container::MemorySource inner_;
};

/// Stalls from a byte on, until it is interrupted or let go.
class StallingSource final : public container::ByteSource {
 public:
  struct Gate {
    std::atomic<bool> open{false};
    std::atomic<int> stalls{0};
  };
  StallingSource(Bytes bytes, std::uint64_t from, std::shared_ptr<Gate> gate,
                 std::shared_ptr<Interrupt> interrupt)
      : inner_(std::move(bytes)), from_(from), gate_(std::move(gate)), interrupt_(interrupt) {}
  Result<std::size_t> read(std::span<std::uint8_t> out) override {
    if (at_ >= from_ && !gate_->open) {
      ++gate_->stalls;
      while (!gate_->open) {
        if (interrupt_->raised()) return fail(ErrorCode::kCancelled, "cancelled");
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    }
    auto got = inner_.read(out.first(std::min<std::size_t>(out.size(), 4096)));
    if (got) at_ += *got;
    return got;
  }
  [[nodiscard]] std::optional<std::uint64_t> size() const override { return inner_.size(); }
  [[nodiscard]] bool seekable() const override { return true; }
  Status seek(std::uint64_t offset) override {
    at_ = offset;
    return inner_.seek(offset);
  }

 private:
  container::MemorySource inner_;
  std::uint64_t from_, at_ = 0;
  std::shared_ptr<Gate> gate_;
  std::shared_ptr<Interrupt> interrupt_;
};

inline std::unique_ptr<container::ByteSource> memory_source(Bytes bytes) {
  return std::make_unique<container::MemorySource>(std::move(bytes));
}

inline std::unique_ptr<Prefetcher> prefetch(std::unique_ptr<container::ByteSource> source,
                                            PrefetchOptions options = {}, int threads = 2,
                                            std::shared_ptr<Interrupt> interrupt = nullptr) {
  auto demuxer = ClipDemuxer::open(std::move(source), "clip", {{}, false, std::move(interrupt)});
  if (!demuxer) FAIL(demuxer.error().message);
  auto pool = WorkerPool::create(threads);
  REQUIRE(pool);
  auto prefetcher = Prefetcher::create(std::move(*demuxer), *pool, options);
  if (!prefetcher) FAIL(prefetcher.error().message);
  return std::move(*prefetcher);
}

/// A frame's samples, exponents and pose, byte by byte.
inline Bytes fingerprint(const ClipFrame& frame) {
  Bytes bytes;
  const auto add = [&](const SampleView& view) {
    for (int y = 0; y < view.height && !view.empty(); ++y) {
      const auto* row = view.data + y * view.stride_bytes;
      bytes.insert(bytes.end(), row, row + std::ptrdiff_t{view.width} * view.bytes_per_sample);
    }
  };
  for (const PlaneView& plane : frame.planes.planes()) {
    bytes.push_back(plane.mantissa.empty() ? 0 : 1);
    add(plane.mantissa);
    add(plane.exponent);
  }
  const auto* palette = reinterpret_cast<const std::uint8_t*>(frame.pose.palette.data());
  bytes.insert(bytes.end(), palette, palette + frame.pose.palette.size() * sizeof(glm::mat4x3));
  return bytes;
}

constexpr double kPatience_s = 60;  // a hang, not a slow machine

inline Bytes fetched(Prefetcher& prefetcher, std::uint64_t index) {
  prefetcher.want(index);
  const auto came = prefetcher.wait(index, kPatience_s);
  INFO("frame " << index << ": " << (came ? "" : came.error().message));
  REQUIRE(came);
  REQUIRE(*came);
  const ClipFrame* frame = prefetcher.frame(index);
  REQUIRE(frame != nullptr);
  return fingerprint(*frame);
}

/// All frames of a clip as ClipReader gives them, one after another.
inline std::vector<Bytes> all_frames(const Bytes& file, const ClipOptions& options = {}) {
  auto clip = ClipReader::open(memory_source(file), "clip", options);
  REQUIRE(clip);
  std::vector<Bytes> frames;
  ClipFrame frame;
  for (std::uint64_t k = 0; k < clip->clip().frame_count; ++k) {
    REQUIRE(clip->frame(k, frame));
    frames.push_back(fingerprint(frame));
  }
  return frames;
}

}  // namespace relit::player::test
