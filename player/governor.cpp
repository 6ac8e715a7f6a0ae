// SPDX-License-Identifier: MIT
#include "player/governor.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace relit::player {
namespace {

constexpr double kLeak = 1.0 / 64;        // late frames forgiven by each good one
constexpr double kFull = 4;               // late frames that cost a rung
constexpr double kCalm = 2;               // late frames below which there is calm
constexpr double kHeadroom = 0.75;        // of the deadline
constexpr double kLoadWeight = 1.0 / 16;  // of one frame in the mean load

constexpr std::int64_t kMillisecond = 1'000'000;
constexpr std::int64_t kSecond = 1000 * kMillisecond;
constexpr std::int64_t kBetweenSwitches = 250 * kMillisecond;
constexpr std::int64_t kSilence = kSecond;
constexpr std::int64_t kFirstRetry = kSecond;
constexpr std::int64_t kLastRetry = 64 * kSecond;
constexpr std::int64_t kProbation = 5 * kSecond;
constexpr std::int64_t kProven = 16 * kSecond;

Status check_fps(double fps) {
  if (fps >= 1 && fps <= 1000) return {};
  return fail(ErrorCode::kInvalid,
              "a target of " + std::to_string(fps) + " frames/s; it must lie between 1 and 1000");
}

Status check_quality(std::optional<double> quality) {
  if (!quality || (*quality >= 0 && *quality <= 1)) return {};
  return fail(ErrorCode::kInvalid,
              "a quality of " + std::to_string(*quality) + "; it must be auto or 0 to 1");
}

double rung_of(double quality) { return kLowestRung * (1 - quality); }

// A quality that names a rung to within rounding means that rung.
double rung_or_nearest(double quality) {
  const double rung = rung_of(quality), nearest = std::round(rung);
  return std::abs(rung - nearest) < 1e-9 ? nearest : rung;
}

}  // namespace

Quality quality_at_rung(double rung) {
  rung = std::clamp(rung, 0.0, static_cast<double>(kLowestRung));
  Quality quality;
  quality.light_map_every = rung >= 2 ? 3 : rung >= 1 ? 2 : 1;
  quality.planes_share = 1 - 0.25 * std::clamp(rung - 2, 0.0, 3.0);
  quality.half_size = rung >= 6;
  quality.frames_every = rung >= 7 ? 2 : 1;
  return quality;
}

Quality fixed_quality(double quality) { return quality_at_rung(rung_or_nearest(quality)); }

Result<Governor> Governor::create(const GovernorOptions& options) {
  Governor governor;
  governor.retry_ns_.fill(kFirstRetry);
  RELIT_TRY(governor.set_target_fps(options.target_fps));
  RELIT_TRY(governor.set_quality(options.quality));
  return governor;
}

Status Governor::set_target_fps(double fps) {
  RELIT_TRY(check_fps(fps));
  deadline_s_ = 1 / fps;
  return {};
}

Status Governor::set_quality(std::optional<double> quality) {
  RELIT_TRY(check_quality(quality));
  if (!quality && fixed_) {
    rung_ = static_cast<int>(std::lround(rung_of(*fixed_)));
    went_up_ = false;
    last_ns_.reset();
  }
  fixed_ = quality;
  return {};
}

Quality Governor::quality() const {
  return fixed_ ? fixed_quality(*fixed_) : quality_at_rung(rung_);
}

double Governor::value() const {
  return fixed_ ? *fixed_ : 1 - static_cast<double>(rung_) / kLowestRung;
}

void Governor::forget(std::int64_t now_ns) {
  bucket_ = 0;
  load_ = 1;  // nothing is known that would speak for going up
  calm_ns_ = now_ns;
}

void Governor::go_down(std::int64_t now_ns) {
  std::int64_t& retry = retry_ns_[static_cast<std::size_t>(rung_)];
  if (went_up_ && now_ns - switched_ns_ < kProbation) retry = std::min(2 * retry, kLastRetry);
  ++rung_, ++switches_;
  went_up_ = false;
  switched_ns_ = now_ns;
  forget(now_ns);
}

void Governor::go_up(std::int64_t now_ns) {
  --rung_, ++switches_;
  went_up_ = true;
  switched_ns_ = now_ns;
  forget(now_ns);
}

Quality Governor::update(const StageTimes& times) {
  const bool sound = std::isfinite(times.total_s) && times.total_s >= 0;
  if (!sound && !times.missed) return quality();
  const std::int64_t now = last_ns_ ? std::max(times.now_ns, *last_ns_) : times.now_ns;
  if (!last_ns_) switched_ns_ = now;
  if (!last_ns_ || now - *last_ns_ > kSilence) forget(now);
  last_ns_ = now;

  const double load = sound ? times.total_s / deadline_s_ : 1.0;
  const bool late = times.missed || load > 1;
  late_frames_ += late ? 1 : 0;
  if (fixed_) return quality();
  bucket_ = late ? bucket_ + 1 : std::max(0.0, bucket_ - kLeak);
  load_ += kLoadWeight * (std::min(load, 4.0) - load_);
  if (bucket_ >= kCalm || load_ > kHeadroom) calm_ns_ = now;

  if (rung_ < kLowestRung && now - switched_ns_ >= kProven)
    retry_ns_[static_cast<std::size_t>(rung_)] = kFirstRetry;
  if (now - switched_ns_ < kBetweenSwitches) return quality();
  if (bucket_ >= kFull) {
    if (rung_ < kLowestRung) go_down(now);
    bucket_ = std::min(bucket_, kFull);  // what is gathered at the bottom must run out again
  } else if (rung_ > 0 && now - calm_ns_ >= retry_ns_[static_cast<std::size_t>(rung_ - 1)]) {
    go_up(now);
  }
  return quality();
}

}  // namespace relit::player
