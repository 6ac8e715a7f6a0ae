// SPDX-License-Identifier: MIT
#include "bake_minimal/sweep.hpp"

#include <set>
#include <string>

#include "tests/test.hpp"

using namespace relit;
using namespace relit::bake;

namespace {

std::string refusal(const std::string& text) {
  const auto variants = expand_sweep(text, {});
  if (variants) return "";
  CHECK(variants.error().code == ErrorCode::kInvalid);
  return variants.error().message;
}

}  // namespace

TEST_CASE("a sweep is every combination, the last knob fastest") {
  CodingOptions base;
  base.reference_frames = 2;
  const auto variants = expand_sweep("codec=h264,hevc  crf=12,18.5;prediction=on,off", base);
  REQUIRE(variants);
  REQUIRE(variants->size() == 8);
  CHECK((*variants)[0].name == "h264-crf12-prediction-on");
  CHECK((*variants)[1].name == "h264-crf12-prediction-off");
  CHECK((*variants)[7].name == "hevc-crf18.5-prediction-off");
  std::set<std::string> names;
  for (const CodingVariant& variant : *variants) {
    names.insert(variant.name);
    CHECK(variant.coding.reference_frames == 2);
  }
  CHECK(names.size() == 8);
  const CodingOptions& last = variants->back().coding;
  CHECK(last.codec == "hevc");
  CHECK(*last.crf == 18.5);
  CHECK_FALSE(last.predict);
}

TEST_CASE("every knob of a sweep reaches its option") {
  const auto variants = expand_sweep(
      "planes=colour principal-count=9 bit-depth=8 chroma=444 exponent-block=16 exponent-hold=5 "
      "layout=grid encoder-preset=fast",
      {});
  REQUIRE(variants);
  REQUIRE(variants->size() == 1);
  const CodingOptions& o = variants->front().coding;
  CHECK(o.planes == Planes::kColour);
  CHECK(o.principal_count == 9);
  CHECK(*o.bit_depth == 8);
  CHECK(*o.chroma == container::Chroma::k444);
  CHECK(o.exponent_block == 16);
  CHECK(o.exponent_hold == 5);
  CHECK(o.layout == Layout::kGrid);
  CHECK(o.preset == "fast");
  CHECK(variants->front().name == "colour-count9-bits8-444-block16-hold5-grid-fast");
}

TEST_CASE("a sweep that makes no sense is refused, and says why") {
  CHECK(refusal("").find("nothing to vary") != std::string::npos);
  CHECK(refusal("speed=1").find("there are codec, crf") != std::string::npos);
  CHECK(refusal("crf=").find("has no values") != std::string::npos);
  CHECK(refusal("crf").find("has no values") != std::string::npos);
  CHECK(refusal("crf=12,high").find("crf cannot be \"high\"") != std::string::npos);
  CHECK(refusal("layout=diagonal").find("layout cannot be") != std::string::npos);
  // Combinations are checked before anything is traced, and named.
  const std::string paper = refusal("codec=h264,mpeg4 bit-depth=10");
  CHECK(paper.find("mpeg4-bits10") != std::string::npos);
  CHECK(paper.find("8 bits only") != std::string::npos);
  std::string many = "crf=1";
  for (int i = 2; i < 40; ++i) many += "," + std::to_string(i);
  CHECK(refusal(many + " principal-count=" + many.substr(4)).find("more than 1000") !=
        std::string::npos);
}
