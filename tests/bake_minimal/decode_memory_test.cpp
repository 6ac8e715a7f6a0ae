// SPDX-License-Identifier: MIT
#include <algorithm>

#include "decoders/decoder_memory.hpp"
#include "tests/bake_minimal/coding_clip.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::bake;
using namespace relit::bake::test;
using container::Chroma;

namespace {

std::uint64_t decoder_bytes(const Encoded& encoded) {
  std::uint64_t sum = 0;
  for (const container::LayerRecord& layer : encoded.layers) {
    const auto add = [&](const decoders::VideoFormat& format, int pictures) {
      const auto memory = decoders::decoder_memory(format, pictures, 1);
      const auto bytes = decoders::picture_buffer_bytes(format);
      REQUIRE(bytes);
      sum += memory.pictures * *bytes;
    };
    add(decoders::mantissa_format(layer), layer.mantissa_pictures);
    if (layer.has_exponents) add(decoders::exponent_format(layer), layer.exponent_pictures);
  }
  return sum;
}

int most_pictures(const Encoded& encoded) {
  int most = 0;
  for (const auto& layer : encoded.layers) most = std::max<int>(most, layer.mantissa_pictures);
  return most;
}

}  // namespace

TEST_CASE("decode memory is kept by fewer references and less reordering") {
  const Clip clip = smooth_clip(2, 48, 32, 12);
  for (const char* codec : {"h264", "hevc"}) {
    CodingOptions options = quick(codec, 10, Chroma::k420, 0, 0);
    const Encoded free = must_encode(clip, options);
    INFO(codec << ", " << decoder_bytes(free) << " bytes without a bound");
    // Unbound there are five or six pictures a decoder; x265 never gets below four.
    int before = most_pictures(free);
    for (const double share : {0.95, 0.8, 0.7}) {
      options.decode_memory =
          static_cast<std::uint64_t>(share * static_cast<double>(decoder_bytes(free)));
      const Encoded bound = must_encode(clip, options);
      INFO(share);
      CHECK(decoder_bytes(bound) <= options.decode_memory);
      CHECK(most_pictures(bound) <= before);
      before = most_pictures(bound);
      const auto decoded = decode(bound, 12);
      CHECK(decoded);
    }
    CHECK(before < most_pictures(free));
  }
}

TEST_CASE("decode memory that holds no picture is refused with what would do") {
  const Clip clip = smooth_clip(1, 32, 32, 3);
  for (const char* codec : {"h264", "mpeg4", "ffv1"}) {
    const bool ffv1 = std::string(codec) == "ffv1";
    CodingOptions options = quick(codec, 8, ffv1 ? Chroma::k444 : Chroma::k420, 0, 0);
    options.decode_memory = 1;
    const auto refused = encode(clip, options);
    INFO(codec);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == ErrorCode::kInvalid);
    const std::string marker = "at least ";
    const std::size_t at = refused.error().message.find(marker);
    REQUIRE(at != std::string::npos);
    options.decode_memory = std::stoull(refused.error().message.substr(at + marker.size()));
    CHECK(encode(clip, options));
  }
}

TEST_CASE("a bound that is kept anyway changes no byte") {
  const Clip clip = smooth_clip(1, 32, 32, 6);
  CodingOptions options = quick("h264", 8, Chroma::k420, 16, 0);
  const auto bytes = all_bytes(must_encode(clip, options));
  options.decode_memory = std::uint64_t{1} << 30;
  CHECK(all_bytes(must_encode(clip, options)) == bytes);
}
