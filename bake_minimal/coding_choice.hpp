// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "bake_minimal/coding_options.hpp"
#include "bake_minimal/sweep.hpp"
#include "container/base/result.hpp"
#include "decoders/relit_error.hpp"

/// The cheapest coding that is good enough, or the best that is cheap enough.
namespace relit::bake {

/// What is asked of a coding, over the standard lights (decoders::RelitError).
struct Goal {
  enum class Kind : std::uint8_t {
    kPsnr,    ///< relit PSNR of at least `value` decibels
    kError,   ///< 99th percentile of the error over the peak of at most `value`, in (0, 1)
    kBudget,  ///< at most `value` bytes a second, of all that segments hold
  };
  Kind kind = Kind::kPsnr;
  double value = 40;
};

/// What coding and decoding the whole clip once gave.
struct CodingTrial {
  double crf = 0;
  std::uint64_t bytes = 0;  ///< of all segments: light and pose
  decoders::RelitError::Figures figures;
};

/// How far the search went with one candidate.
struct CandidateReport {
  enum class Outcome : std::uint8_t {
    kReached,
    kAbandoned,    ///< one trial told that it would be much larger, or much worse, than another
    kOutOfReach,   ///< `best` is its finest, or with a budget its coarsest
    kUnavailable,  ///< libavcodec has no such encoder here; nothing was tried
  };
  std::string name;
  Outcome outcome = Outcome::kReached;
  CodingTrial best;
  int tries = 0;
};

struct CodingChoice {
  std::size_t candidate = 0;
  CodingTrial trial;
  std::vector<CandidateReport> reports;  ///< of all candidates, in order
  /// The chosen candidate somewhat coarser and somewhat finer: what accuracy costs hereabouts.
  std::vector<CodingTrial> coarser_and_finer;
};

/// Codes and decodes the clip as a candidate says, with another rate factor. Errors: kEnvironment
/// where libavcodec lacks the encoder.
using TryCoding = std::function<Result<CodingTrial>(std::size_t candidate, double crf)>;

/// Ways to code that are worth trying where `base` leaves it open: each codec that pays, or the one
/// of `base` if `any_codec` is false. In the order in which they are likely to win.
[[nodiscard]] std::vector<CodingVariant> coding_candidates(const CodingOptions& base,
                                                           bool any_codec);

/// Searches the rate factor of every candidate, and takes the one that reaches the goal with the
/// fewest bytes; with a budget the one of the highest PSNR. `clip_s`: seconds of the clip.
/// Errors: kInvalid for lossless candidates and where none reaches the goal, saying how far the
/// best came; those of resolve(); other errors of `attempt` than kEnvironment; kEnvironment where
/// no candidate has an encoder.
[[nodiscard]] Result<CodingChoice> choose_coding(const Goal& goal,
                                                 std::span<const CodingVariant> candidates,
                                                 double clip_s, const TryCoding& attempt);

}  // namespace relit::bake
