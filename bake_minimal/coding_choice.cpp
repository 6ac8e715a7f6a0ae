// SPDX-License-Identifier: MIT
#include "bake_minimal/coding_choice.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include "bake_minimal/rate_search.hpp"

namespace relit::bake {
namespace {

using Outcome = CandidateReport::Outcome;

/// Rate factors that double the bytes.
constexpr double kDoubling = 6;
/// Projections from one trial are that much off at most: a candidate that is projected worse than
/// by this is left alone, and so is one that costs that much more and still falls short.
constexpr double kHopelessRatio = 1.3;
constexpr double kHopeless_db = 1.3;
/// How far the neighbours lie that tell what accuracy costs: about 2 dB.
constexpr double kNeighbour = 4;

std::string decimal(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

double decibels(double error) { return -20 * std::log10(error); }

/// The search for one candidate's rate factor. With a budget, factors are negated: the coarsest
/// that reaches the quality becomes the finest that keeps within the bytes.
class CandidateSearch {
 public:
  CandidateSearch(const Goal& goal, double clip_s) : goal_(goal), clip_s_(clip_s) {}

  [[nodiscard]] bool budget() const { return goal_.kind == Goal::Kind::kBudget; }
  [[nodiscard]] double target_db() const {
    if (goal_.kind == Goal::Kind::kPsnr) return goal_.value;
    return budget() ? 0 : decibels(goal_.value);
  }
  /// Decibels, or with a budget what halving the bytes costs, for each halving that is left.
  [[nodiscard]] double score_db(const CodingTrial& trial) const {
    if (goal_.kind == Goal::Kind::kPsnr) return trial.figures.psnr_db;
    if (goal_.kind == Goal::Kind::kError) return decibels(trial.figures.p99);
    const double allowed = std::max(goal_.value * clip_s_, 1.0);
    const double bytes = std::max(static_cast<double>(trial.bytes), 1.0);
    return kRateSlope_db * kDoubling * std::log2(allowed / bytes);
  }
  /// What a trial would cost with the rate factor that just reaches the goal: bytes, or with a
  /// budget the decibels that are missing to 1000, so that less is better either way.
  [[nodiscard]] double projected_cost(const CodingTrial& trial) const {
    const double spare_db = score_db(trial) - target_db();
    if (budget()) return 1000 - (trial.figures.psnr_db + spare_db);
    return static_cast<double>(trial.bytes) * std::exp2(-spare_db / kRateSlope_db / kDoubling);
  }
  [[nodiscard]] bool hopeless(double cost, double best) const {
    return budget() ? cost > best + kHopeless_db : cost > best * kHopelessRatio;
  }
  [[nodiscard]] double cost(const CodingTrial& trial) const {
    return budget() ? 1000 - trial.figures.psnr_db : static_cast<double>(trial.bytes);
  }

  /// `attempt` by rate factor. `best_cost`: of another candidate; infinite where there is none.
  Result<CandidateReport> run(const RateRange& range, double begin, double best_cost,
                              const std::function<Result<CodingTrial>(double)>& attempt) const {
    CandidateReport report;
    std::vector<CodingTrial> trials;
    const double sign = budget() ? -1 : 1;
    bool abandoned = false;
    const auto score = [&](double signed_crf) -> Result<double> {
      RELIT_ASSIGN(const CodingTrial trial, attempt(sign * signed_crf));
      trials.push_back(trial);
      const bool short_of_it = score_db(trial) < target_db();
      abandoned = (trials.size() == 1 && hopeless(projected_cost(trial), best_cost)) ||
                  (short_of_it && hopeless(cost(trial), best_cost));
      // The search ends at once with what it takes for the target.
      return abandoned ? target_db() : score_db(trial);
    };
    const RateRange searched =
        budget() ? RateRange{-range.coarsest, -range.finest, range.step} : range;
    const double first = std::clamp(sign * begin, searched.finest, searched.coarsest);
    RELIT_ASSIGN(const RateChoice rate, search_rate(target_db(), searched, first, score));
    report.best = *std::find_if(trials.rbegin(), trials.rend(), [&](const CodingTrial& trial) {
      return std::abs(trial.crf - sign * rate.crf) < 1e-9;
    });
    report.tries = rate.tries;
    report.outcome = abandoned       ? Outcome::kAbandoned
                     : !rate.reached ? Outcome::kOutOfReach
                                     : Outcome::kReached;
    return report;
  }

 private:
  Goal goal_;
  double clip_s_;
};

Error out_of_reach(const Goal& goal, double clip_s, const CandidateReport& closest) {
  const CodingTrial& trial = closest.best;
  if (goal.kind == Goal::Kind::kBudget) {
    return {ErrorCode::kInvalid, "the budget of " + decimal(goal.value * 8 / 1000) +
                                     " kbit/s is out of reach: the coarsest rate factor, " +
                                     decimal(trial.crf) + ", takes " +
                                     decimal(static_cast<double>(trial.bytes) / clip_s * 8 / 1000) +
                                     " kbit/s; use a smaller --size, --order or --fps"};
  }
  const bool psnr = goal.kind == Goal::Kind::kPsnr;
  return {ErrorCode::kInvalid,
          (psnr ? decimal(goal.value) + " dB are" : "an error of " + decimal(goal.value) + " is") +
              " out of reach: the finest rate factor, " + decimal(trial.crf) + ", gives " +
              (psnr ? decimal(trial.figures.psnr_db) + " dB" : decimal(trial.figures.p99)) +
              "; use --bit-depth 10, more --principal-count or --planes colour"};
}

}  // namespace

std::vector<CodingVariant> coding_candidates(const CodingOptions& base, bool any_codec) {
  if (!any_codec) return {{base.codec, base}};
  std::vector<CodingVariant> candidates;
  // AV1 took 3 to 12 % more than HEVC wherever it was measured, and several times as long.
  for (const char* codec : {"hevc", "h264"}) {
    CodingVariant variant{codec, base};
    variant.coding.codec = codec;
    candidates.push_back(std::move(variant));
  }
  return candidates;
}

Result<CodingChoice> choose_coding(const Goal& goal, std::span<const CodingVariant> candidates,
                                   double clip_s, const TryCoding& attempt) {
  const CandidateSearch search(goal, clip_s);
  CodingChoice choice;
  std::vector<CodingOptions> codings;
  std::optional<std::size_t> best;
  std::optional<std::size_t> closest;  // of those that fall short
  std::optional<Error> unavailable;
  std::optional<double> begin;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    RELIT_ASSIGN(codings.emplace_back(), resolve(candidates[i].coding));
    if (codings[i].lossless)
      return fail(ErrorCode::kInvalid, "a target needs a lossy codec, and not --lossless");
    const double best_cost = best ? search.cost(choice.reports[*best].best) : HUGE_VAL;
    auto found = search.run(rate_range(codings[i]), begin.value_or(*codings[i].crf), best_cost,
                            [&](double crf) { return attempt(i, crf); });
    if (!found && found.error().code != ErrorCode::kEnvironment) return Unexpected{found.error()};
    CandidateReport report;
    if (found) {
      report = *std::move(found);
    } else {
      report.outcome = Outcome::kUnavailable;
      unavailable = found.error();
    }
    report.name = candidates[i].name;
    choice.reports.push_back(std::move(report));
    const CandidateReport& mine = choice.reports.back();
    const auto better = [&](const std::optional<std::size_t>& than, auto cost) {
      return !than || cost(mine.best) < cost(choice.reports[*than].best);
    };
    if (mine.outcome == Outcome::kReached) {
      if (better(best, [&](const CodingTrial& t) { return search.cost(t); })) best = i;
      begin = mine.best.crf;
    } else if (mine.outcome == Outcome::kOutOfReach) {
      if (better(closest, [&](const CodingTrial& t) { return -search.score_db(t); })) closest = i;
    }
  }
  if (!best && closest) return Unexpected{out_of_reach(goal, clip_s, choice.reports[*closest])};
  if (!best) return Unexpected{*unavailable};
  choice.candidate = *best;
  choice.trial = choice.reports[*best].best;
  const RateRange range = rate_range(codings[*best]);
  for (const double offset : {kNeighbour, -kNeighbour}) {
    const double crf = std::clamp(choice.trial.crf + offset, range.finest, range.coarsest);
    if (crf == choice.trial.crf) continue;
    RELIT_ASSIGN(const CodingTrial trial, attempt(*best, crf));
    choice.coarser_and_finer.push_back(trial);
  }
  return choice;
}

}  // namespace relit::bake
