// SPDX-License-Identifier: MIT
#include "bake_minimal/coding_options.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <string_view>
#include <tuple>

#include "container/base/limits.hpp"

namespace relit::bake {
namespace {

using container::Chroma;

struct CodecTraits {
  std::string_view name;
  bool lossy;
  bool lossless;
  bool ten_bits;
  bool only_420;
  double crf_min, crf_max, crf_default;
};

constexpr double kPrincipalFiner = 6;

constexpr std::array<CodecTraits, 6> kCodecs = {{
    {"h264", true, true, true, false, -12, 51, 24},
    {"hevc", true, true, true, false, 0, 51, 24},
    {"mpeg4", true, false, false, true, 0, 51, 22},
    {"ffv1", false, true, true, false, 0, 0, 0},
    {"vp9", true, true, true, false, 0, 63, 24},
    {"av1", true, false, true, false, 0, 63, 24},
}};

const CodecTraits* find_codec(std::string_view name) {
  for (const CodecTraits& codec : kCodecs)
    if (codec.name == name) return &codec;
  return nullptr;
}

Unexpected invalid(std::string message) { return fail(ErrorCode::kInvalid, std::move(message)); }

Status choose_planes(CodingOptions& o, bool only_420) {
  const bool possible = o.exponent_block == 0 && (!o.chroma || *o.chroma != Chroma::k444) &&
                        !(o.lossless && o.chroma == Chroma::k420);
  if (o.planes == Planes::kAuto) {
    const bool natural =
        possible && !only_420 && !o.chroma && !o.lossless && o.layout == Layout::kLayered;
    o.planes = natural ? Planes::kPrincipal : Planes::kColour;
  }
  if (o.planes == Planes::kColour) return {};
  if (!possible) {
    return invalid(
        "--planes principal takes --chroma luma, or 420 for decoders that have nothing else, and "
        "--exponent-block 0");
  }
  if (o.principal_count < 0 || o.principal_count > 48) {
    return invalid("principal planes are 1 to 48, or 0, not " + std::to_string(o.principal_count));
  }
  if (!o.chroma) o.chroma = only_420 ? Chroma::k420 : Chroma::kLuma;
  return {};
}

Status check_numbers(const CodingOptions& o, const CodecTraits& codec) {
  if (*o.bit_depth != 8 && *o.bit_depth != 10) {
    return invalid("--bit-depth is 8 or 10, not " + std::to_string(*o.bit_depth));
  }
  if (!std::isfinite(*o.crf) || *o.crf < codec.crf_min || *o.crf > codec.crf_max) {
    return invalid("--crf for " + o.codec + " is a number from " +
                   std::to_string(static_cast<int>(codec.crf_min)) + " to " +
                   std::to_string(static_cast<int>(codec.crf_max)));
  }
  if (o.codec == "h264" && *o.bit_depth == 8 && *o.crf < 0) {
    return invalid("--crf below 0 needs --bit-depth 10");
  }
  if (o.exponent_block != 0 && (o.exponent_block < 1 || o.exponent_block > 32 ||
                                !std::has_single_bit(static_cast<unsigned>(o.exponent_block)))) {
    return invalid("--exponent-block is 1, 2, 4, 8, 16, 32, or 0 for none, not " +
                   std::to_string(o.exponent_block));
  }
  if (o.exponent_hold < 0) return invalid("--exponent-hold is a number of frames, or 0");
  const auto longest = static_cast<int>(limits::kFramesPerSegment);
  if (o.segment_frames < 1 || o.segment_frames > longest) {
    return invalid("a segment has 1 to " + std::to_string(longest) + " frames, not " +
                   std::to_string(o.segment_frames));
  }
  if (o.reference_frames < 1 || o.reference_frames > 16) {
    return invalid("reference frames are 1 to 16, not " + std::to_string(o.reference_frames));
  }
  if (o.threads < 1) return invalid("at least one thread is needed");
  return {};
}

}  // namespace

RateRange rate_range(const CodingOptions& o) {
  const CodecTraits* const codec = find_codec(o.codec);
  const bool eight_bit_h264 = o.codec == "h264" && *o.bit_depth == 8;
  const bool fine = o.codec == "h264" || o.codec == "hevc";
  return {eight_bit_h264 ? 0 : codec->crf_min, codec->crf_max, fine ? 0.25 : 1};
}

CodingOptions paper_options() {
  CodingOptions options;
  options.codec = "mpeg4";
  options.bit_depth = 8;
  options.chroma = Chroma::k420;
  options.exponent_block = 1;
  options.exponent_hold = 1;
  options.layout = Layout::kGrid;
  return options;
}

bool same_planes(const CodingOptions& a, const CodingOptions& b) {
  const auto planes = [](const CodingOptions& o) {
    return std::tuple(o.lossless, *o.bit_depth, o.planes, o.principal_count, o.predict, *o.chroma,
                      o.exponent_block, o.exponent_hold, o.frame_step, o.layout, o.segment_frames,
                      o.uniform_steps, o.centred);
  };
  return planes(a) == planes(b);
}

Result<CodingOptions> hardware_options(const CodingOptions& base) {
  CodingOptions options = base;
  options.codec = "h264";
  options.bit_depth = 8;
  options.chroma = Chroma::k420;
  if (options.planes == Planes::kAuto) options.planes = Planes::kPrincipal;
  if (options.lossless || options.exponent_block != 0) {
    return invalid(
        "--profile hardware is lossy H.264 without exponents, whose pictures are FFV1: leave out "
        "--lossless and --exponent-block");
  }
  return options;
}

Result<CodingOptions> resolve(CodingOptions o) {
  const CodecTraits* const codec = find_codec(o.codec);
  if (codec == nullptr) {
    return invalid("--codec " + o.codec +
                   " is not known; h264, hevc, mpeg4, ffv1, vp9 and av1 are");
  }
  if (!codec->lossy) o.lossless = true;
  if (o.frame_step < 0 || o.frame_step > 64) {
    return invalid("--frame-step is 1 to 64, not " + std::to_string(o.frame_step));
  }
  o.frame_step = std::max(o.frame_step, 1);
  if (o.lossless && !codec->lossless) {
    return invalid("--codec " + o.codec + " cannot be lossless; h264, hevc, vp9 and ffv1 can");
  }
  RELIT_TRY(choose_planes(o, codec->only_420));
  const bool given_no_crf = !o.crf && !o.lossless;
  if (!o.bit_depth) o.bit_depth = codec->ten_bits && o.exponent_block == 0 ? 10 : 8;
  if (!o.chroma) o.chroma = o.lossless ? Chroma::k444 : Chroma::k420;
  if (!o.crf || o.lossless) o.crf = codec->crf_default;
  // Steps of principal planes are relative to s, whose range is wider than any colour's.
  if (given_no_crf && o.planes == Planes::kPrincipal) o.crf = *o.crf - kPrincipalFiner;
  if (o.preset.empty()) {
    if (o.codec == "h264") o.preset = "veryslow";
    if (o.codec == "hevc") o.preset = "slow";
    if (o.codec == "vp9" || o.codec == "av1") o.preset = "4";
  }
  if (*o.bit_depth == 10 && !codec->ten_bits) {
    return invalid("--codec " + o.codec + " has 8 bits only: use --bit-depth 8, or --codec h264");
  }
  if (codec->only_420 && *o.chroma != Chroma::k420) {
    return invalid("--codec " + o.codec + " has 4:2:0 only: use --chroma 420, or --codec h264");
  }
  if (o.lossless && *o.chroma == Chroma::k420) {
    return invalid(std::string(codec->lossy ? "--lossless" : "--codec ffv1, which is lossless,") +
                   " needs --chroma 444 or luma: 4:2:0 averages colour, and rounded YCoCg does not "
                   "give back R, G and B");
  }
  RELIT_TRY(check_numbers(o, *codec));
  return o;
}

}  // namespace relit::bake
