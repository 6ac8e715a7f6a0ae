// SPDX-License-Identifier: MIT
#include "player/clip_reader.hpp"

#include "tests/player/files.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::player;
using namespace relit::player::test;

namespace {

// Bytes that can only be read forward, as from a pipe.
class PipeSource final : public container::ByteSource {
 public:
  explicit PipeSource(std::vector<std::uint8_t> bytes) : inner_(std::move(bytes)) {}
  Result<std::size_t> read(std::span<std::uint8_t> out) override {
    return inner_.read(out.first(std::min<std::size_t>(out.size(), 1000)));
  }

 private:
  container::MemorySource inner_;
};

Result<ClipReader> open(std::vector<std::uint8_t> bytes, const ClipOptions& options = {}) {
  return ClipReader::open(std::make_unique<container::MemorySource>(std::move(bytes)), "clip",
                          options);
}

std::vector<float> transfer(ClipReader& clip, std::uint64_t k) {
  ClipFrame frame;
  REQUIRE(clip.frame(k, frame));
  std::vector<float> out(std::size_t{27} * clip.model().width * clip.model().height);
  REQUIRE(decoders::reconstruct(frame.planes.planes(), clip.model(), clip.layers(), out));
  return out;
}

}  // namespace

TEST_CASE("the shipped clip is complete, small and loops") {
  auto bytes = read_bytes(shipped_clip());
  CHECK(bytes.size() <= 1'500'000);
  auto clip = open(bytes);
  REQUIRE(clip);
  CHECK(clip->clip().loop);
  CHECK(static_cast<double>(clip->clip().frame_count) *
            static_cast<double>(clip->clip().tick_rate.den) >=
        2.0 * static_cast<double>(clip->clip().tick_rate.num));
  ClipFrame frame;
  for (std::uint64_t k = 0; k < clip->clip().frame_count; ++k) {
    REQUIRE(clip->frame(k, frame));
    CHECK(frame.planes.frame() == k);
  }
  CHECK_FALSE(clip->loss().any());
}

TEST_CASE("frames are the same in any order, and from a pipe") {
  const auto bytes = read_bytes(shipped_clip());
  auto clip = open(bytes);
  REQUIRE(clip);
  const auto at3 = transfer(*clip, 3), at60 = transfer(*clip, 60), at61 = transfer(*clip, 61);
  CHECK(at3 != at60);
  CHECK(transfer(*clip, 3) == at3);
  CHECK(transfer(*clip, 61) == at61);
  CHECK(transfer(*clip, 60) == at60);
  auto piped = ClipReader::open(std::make_unique<PipeSource>(bytes), "pipe", {});
  REQUIRE(piped);
  CHECK(transfer(*piped, 3) == at3);
  CHECK(transfer(*piped, 60) == at60);
  ClipFrame frame;
  const Status back = piped->frame(3, frame);
  REQUIRE_FALSE(back);
  CHECK(back.error().code == ErrorCode::kNotFound);
  CHECK(back.error().message.find("cannot go back") != std::string::npos);
}

TEST_CASE("layers from the first on can be decoded by themselves") {
  ClipOptions options;
  options.layers = 1;
  auto clip = open(read_bytes(shipped_clip()), options);
  REQUIRE(clip);
  ClipFrame frame;
  REQUIRE(clip->frame(0, frame));
  const auto planes = frame.planes.planes();
  CHECK_FALSE(planes[0].mantissa.empty());
  CHECK(planes[3].mantissa.empty());
}

TEST_CASE("what is not there is named") {
  auto clip = open(read_bytes(shipped_clip()));
  REQUIRE(clip);
  ClipFrame frame;
  const Status beyond = clip->frame(clip->clip().frame_count, frame);
  REQUIRE_FALSE(beyond);
  CHECK(beyond.error().message.find("frames, from 0 on") != std::string::npos);
  ClipOptions options;
  options.clip = "swim";
  const auto other = open(read_bytes(shipped_clip()), options);
  REQUIRE_FALSE(other);
  CHECK(other.error().message.find("swim") != std::string::npos);
  CHECK(other.error().message.find(clip->clip().name) != std::string::npos);
  const auto text = open({'h', 'e', 'l', 'l', 'o'});
  REQUIRE_FALSE(text);
  CHECK(text.error().message.find("clip: ") == 0);
}

TEST_CASE("damage in a segment costs its frames and no more") {
  const auto bytes = read_bytes(shipped_clip());
  auto clean = open(bytes);
  REQUIRE(clean);
  const auto last = transfer(*clean, clean->clip().frame_count - 1);
  auto index_reader = container::Reader::open(std::make_unique<container::MemorySource>(bytes));
  REQUIRE(index_reader);
  const auto index = index_reader->read_index();
  REQUIRE(index);
  REQUIRE(index->segments.size() > 2);
  auto damaged = bytes;
  const auto second = index->segments[1], third = index->segments[2];
  for (std::uint64_t at = second.offset + 400; at < third.offset; at += 97) damaged[at] ^= 0x55;
  auto clip = open(damaged);
  REQUIRE(clip);
  ClipFrame frame;
  for (std::uint64_t k = 0; k < clip->clip().frame_count; ++k) {
    INFO(k);
    REQUIRE(clip->frame(k, frame));
  }
  CHECK(clip->loss().frames > 0);
  CHECK(clip->loss().frames <= second.frame_count);
  CHECK(transfer(*clip, clip->clip().frame_count - 1) == last);
}

TEST_CASE("a truncated file plays as far as it goes and then holds") {
  auto bytes = read_bytes(shipped_clip());
  bytes.resize(bytes.size() * 2 / 3);
  auto clip = open(bytes);
  REQUIRE(clip);
  ClipFrame frame;
  for (std::uint64_t k = 0; k < clip->clip().frame_count; ++k) REQUIRE(clip->frame(k, frame));
  CHECK(clip->loss().frames > 0);
  CHECK(clip->loss().frames < clip->clip().frame_count);
}
