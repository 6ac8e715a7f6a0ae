// SPDX-License-Identifier: MIT
#include "bake_minimal/coding_choice.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/test.hpp"

using namespace relit;
using namespace relit::bake;

namespace {

using Outcome = CandidateReport::Outcome;

/// An encoder: `size` times the bytes of another at the same quality, and how its quality falls.
struct Encoder {
  double size = 1;
  double finest_db = 58;
  bool exists = true;
};

constexpr double kClip_s = 2;

CodingTrial code(const Encoder& encoder, double crf) {
  CodingTrial trial;
  trial.crf = crf;
  trial.figures.psnr_db = encoder.finest_db - 0.5 * crf - 0.004 * crf * crf;
  trial.figures.p99 = 3 * std::pow(10, -trial.figures.psnr_db / 20);
  trial.bytes = static_cast<std::uint64_t>(encoder.size * 1e6 * std::exp2(-crf / 6));
  return trial;
}

struct Searched {
  Result<CodingChoice> choice;
  std::vector<int> tries;
};

Searched search(const Goal& goal, const std::vector<Encoder>& encoders) {
  std::vector<CodingVariant> candidates(encoders.size());
  for (std::size_t i = 0; i < encoders.size(); ++i) {
    candidates[i].name = "encoder " + std::to_string(i);
    candidates[i].coding.codec = "hevc";
  }
  std::vector<int> tries(encoders.size());
  auto choice = choose_coding(goal, candidates, kClip_s,
                              [&](std::size_t candidate, double crf) -> Result<CodingTrial> {
                                ++tries[candidate];
                                CHECK((crf >= 0 && crf <= 51));
                                if (!encoders[candidate].exists)
                                  return fail(ErrorCode::kEnvironment, "no such encoder");
                                return code(encoders[candidate], crf);
                              });
  return {std::move(choice), std::move(tries)};
}

}  // namespace

TEST_CASE("the encoder with the fewest bytes is taken, and neighbours tell the price") {
  for (const double target : {32.0, 40.0, 48.0}) {
    INFO(target);
    const auto [choice, tries] =
        search({Goal::Kind::kPsnr, target}, {{1.1}, {1.0}, {1.02}, {1.0, 58, false}});
    REQUIRE(choice);
    CHECK(choice->candidate == 1);
    CHECK(choice->trial.figures.psnr_db >= target);
    CHECK(choice->trial.figures.psnr_db < target + 0.25);
    CHECK(choice->reports[0].outcome == Outcome::kReached);
    CHECK(choice->reports[3].outcome == Outcome::kUnavailable);
    CHECK(choice->reports[3].tries == 0);
    REQUIRE(choice->coarser_and_finer.size() == 2);
    CHECK(choice->coarser_and_finer[0].figures.psnr_db < target - 1);
    CHECK(choice->coarser_and_finer[1].figures.psnr_db > target + 1);
    // One begins where the other ended, a try or two from the end.
    CHECK(tries[2] <= 3);
  }
}

TEST_CASE("an encoder that needs much more is left after one try, and one that looks so is not") {
  const auto [choice, tries] = search({Goal::Kind::kPsnr, 40}, {{1.0}, {2.0}, {1.2}});
  REQUIRE(choice);
  CHECK(choice->candidate == 0);
  CHECK(choice->reports[1].outcome == Outcome::kAbandoned);
  CHECK(tries[1] == 1);
  CHECK(choice->reports[2].outcome == Outcome::kReached);
}

TEST_CASE("the error of the 99th percentile is sought like a PSNR") {
  const auto [choice, tries] = search({Goal::Kind::kError, 0.02}, {{1.0}});
  REQUIRE(choice);
  CHECK(choice->trial.figures.p99 <= 0.02);
  // A step of a quarter is at most 0.23 dB, 2.7 %.
  CHECK(choice->trial.figures.p99 > 0.02 * 0.97);
}

TEST_CASE("a budget is used up, and not exceeded, by the encoder of the best quality") {
  const auto [choice, tries] =
      search({Goal::Kind::kBudget, 40e3}, {{1.0, 57}, {1.0, 58}, {1.0, 50}});
  REQUIRE(choice);
  CHECK(choice->candidate == 1);
  const auto bytes = static_cast<double>(choice->trial.bytes);
  CHECK(bytes <= 40e3 * kClip_s);
  // Within 0.15 dB as the search counts, a twenty-second of a halving, or a step of a quarter: 3 %.
  CHECK(bytes > 40e3 * kClip_s * 0.95);
  CHECK(choice->reports[2].outcome == Outcome::kAbandoned);
}

TEST_CASE("a goal that nothing reaches tells how far the best came") {
  const auto beyond = search({Goal::Kind::kPsnr, 70}, {{1.0, 56}, {1.0, 58}}).choice;
  REQUIRE(!beyond);
  CHECK(beyond.error().code == ErrorCode::kInvalid);
  CHECK(beyond.error().message.find("gives 58 dB") != std::string::npos);
  const auto poor = search({Goal::Kind::kBudget, 10}, {{1.0}}).choice;
  REQUIRE(!poor);
  CHECK(poor.error().message.find("0.08 kbit/s") != std::string::npos);
  CHECK(poor.error().message.find("--size") != std::string::npos);
  // Where one reaches it, the other is only told of.
  const auto one = search({Goal::Kind::kPsnr, 57}, {{1.0, 56}, {1.0, 58}}).choice;
  REQUIRE(one);
  CHECK(one->candidate == 1);
  CHECK(one->reports[0].outcome == Outcome::kOutOfReach);
}

TEST_CASE("a target takes a lossy coding and an encoder") {
  const auto none = search({Goal::Kind::kPsnr, 40}, {{1.0, 58, false}}).choice;
  REQUIRE(!none);
  CHECK(none.error().code == ErrorCode::kEnvironment);
  CodingVariant lossless{"h264", {}};
  lossless.coding.lossless = true;
  const auto refused = choose_coding({}, std::span(&lossless, 1), kClip_s, [](std::size_t, double) {
    return Result<CodingTrial>(CodingTrial{});
  });
  REQUIRE(!refused);
  CHECK(refused.error().code == ErrorCode::kInvalid);
}

TEST_CASE("candidates are every codec that pays, or the one that was named") {
  CodingOptions base;
  base.exponent_hold = 7;
  const auto named = coding_candidates(base, false);
  REQUIRE(named.size() == 1);
  CHECK(named[0].coding.codec == "h264");
  const auto all = coding_candidates(base, true);
  REQUIRE(all.size() > 1);
  for (const CodingVariant& each : all) {
    CHECK(each.name == each.coding.codec);
    CHECK(each.coding.exponent_hold == 7);
    CHECK(resolve(each.coding));
  }
}

TEST_CASE("the hardware profile is eight bits of 4:2:0 with principal planes") {
  const auto options = hardware_options({});
  REQUIRE(options);
  const auto resolved = resolve(*options);
  REQUIRE(resolved);
  CHECK(resolved->codec == "h264");
  CHECK(*resolved->bit_depth == 8);
  CHECK(*resolved->chroma == container::Chroma::k420);
  CHECK(resolved->planes == Planes::kPrincipal);
  CodingOptions lossless;
  lossless.lossless = true;
  CHECK_FALSE(hardware_options(lossless));
  CodingOptions blocks;
  blocks.exponent_block = 8;
  CHECK_FALSE(hardware_options(blocks));
}
