// SPDX-License-Identifier: MIT
#include <functional>

#include "bake_minimal/plane_layout.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::bake;
using container::Chroma;

namespace {

PlaneSplit colour_planes(int order, int width, int height, const CodingOptions& options) {
  return PlaneSplit::colour({order, width, height}, options);
}

}  // namespace

TEST_CASE("open options take the best value for the rest") {
  const auto plain = resolve({});
  REQUIRE(plain);
  CHECK(*plain->bit_depth == 10);
  CHECK(plain->planes == Planes::kPrincipal);
  CHECK(*plain->chroma == Chroma::kLuma);
  CHECK(*plain->crf == 18);
  CodingOptions o;
  o.planes = Planes::kColour;
  CHECK(*resolve(o)->chroma == Chroma::k420);
  o = {};
  o.codec = "mpeg4";
  CHECK(*resolve(o)->bit_depth == 8);
  o.codec = "ffv1";
  CHECK(resolve(o)->lossless);
  CHECK(*resolve(o)->chroma == Chroma::k444);
  o = {};
  o.exponent_block = 16;
  CHECK(*resolve(o)->bit_depth == 8);
  CHECK(resolve(o)->planes == Planes::kColour);
  o = {};
  o.lossless = true;
  CHECK(resolve(o)->planes == Planes::kColour);
  CHECK(resolve(paper_options()));
}

TEST_CASE("combinations that cannot work are refused with what would") {
  struct Case {
    std::function<void(CodingOptions&)> change;
    const char* remedy;
  };
  const Case cases[] = {
      {[](CodingOptions& o) { o.codec = "theora"; }, "h264"},
      {[](CodingOptions& o) { o.codec = "mpeg4", o.bit_depth = 10; }, "--bit-depth 8"},
      {[](CodingOptions& o) { o.codec = "mpeg4", o.chroma = Chroma::k444; }, "--chroma 420"},
      {[](CodingOptions& o) { o.codec = "mpeg4", o.lossless = true; }, "ffv1"},
      {[](CodingOptions& o) { o.lossless = true, o.chroma = Chroma::k420; },
       "--chroma 444 or luma"},
      {[](CodingOptions& o) { o.codec = "ffv1", o.chroma = Chroma::k420; }, "--chroma 444 or luma"},
      {[](CodingOptions& o) { o.bit_depth = 12; }, "8 or 10"},
      {[](CodingOptions& o) { o.crf = 52; }, "-12 to 51"},
      {[](CodingOptions& o) { o.crf = -3, o.bit_depth = 8; }, "--bit-depth 10"},
      {[](CodingOptions& o) { o.exponent_block = 3; }, "1, 2, 4, 8, 16, 32"},
      {[](CodingOptions& o) { o.exponent_block = 64; }, "1, 2, 4, 8, 16, 32"},
      {[](CodingOptions& o) { o.exponent_hold = -1; }, "number of frames"},
      {[](CodingOptions& o) { o.segment_frames = 0; }, "1 to"},
      {[](CodingOptions& o) { o.reference_frames = 17; }, "1 to 16"},
      {[](CodingOptions& o) { o.threads = 0; }, "one thread"},
  };
  for (const Case& c : cases) {
    CodingOptions o;
    c.change(o);
    const auto resolved = resolve(o);
    INFO(c.remedy);
    REQUIRE(!resolved);
    CHECK(resolved.error().code == ErrorCode::kInvalid);
    CHECK(resolved.error().message.find(c.remedy) != std::string::npos);
  }
}

TEST_CASE("components and RGB are each other's inverse") {
  for (const Basis basis : {Basis::kYCoCg, Basis::kGbr}) {
    // Dyadic numbers, so that nothing rounds.
    const std::array<double, 3> rgb = {0.75, -1.5, 3.25};
    CHECK(to_rgb(basis, to_components(basis, rgb)) == rgb);
  }
  CHECK(to_components(Basis::kYCoCg, {1, 0, 0}) == std::array<double, 3>{0.25, 0.5, -0.25});
  CHECK(to_components(Basis::kGbr, {1, 2, 3}) == std::array<double, 3>{2, 3, 1});
  CHECK(to_components(Basis::kLuma, {1, 2, 6})[0] == 3);
}

TEST_CASE("a layer holds a band, in rows that the smallest machines can take") {
  CodingOptions colour;
  colour.planes = Planes::kColour;
  const auto options = resolve(colour);
  REQUIRE(options);
  const auto plans = plan_layers(colour_planes(3, 500, 130, *options), *options, {1, 5, 9});
  REQUIRE(plans);
  REQUIRE(plans->size() == 4);
  const int columns[] = {1, 3, 3, 4}, rows[] = {1, 1, 2, 2};
  for (std::size_t l = 0; l < 4; ++l) {
    const LayerPlan& plan = (*plans)[l];
    CHECK(plan.tiles.size() == 2 * l + 1);
    CHECK(plan.tiles[0] == static_cast<int>(l * l));
    CHECK(plan.record.coded_width == 512 * columns[l]);
    CHECK(plan.record.coded_height == 144 * rows[l]);
    CHECK(plan.record.id == 5 + l);
    CHECK(plan.record.mantissa_track == 9 + l);
    CHECK(plan.record.planes.size() == 3 * (2 * l + 1));
    for (const auto& plane : plan.record.planes) {
      CHECK(plane.mantissa_rect.width == 500);
      CHECK(plane.mantissa_rect.x % 16 == 0);
    }
  }
}

TEST_CASE("pictures and light maps that are too large are refused") {
  CodingOptions o;
  o.layout = Layout::kGrid;
  const auto options = resolve(o);
  REQUIRE(options);
  CHECK(plan_layers(colour_planes(3, 4096, 4096, *options), *options, {}));
  CHECK(!plan_layers(colour_planes(3, 4097, 16, *options), *options, {}));
  CHECK(!plan_layers(colour_planes(3, 0, 16, *options), *options, {}));
  CHECK(!plan_layers(colour_planes(4, 16, 16, *options), *options, {}));
}
