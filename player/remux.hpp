// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "container/byte_sink.hpp"
#include "player/rewrite.hpp"

namespace relit::player {

/// What of a file remux() keeps. By default everything.
struct RemuxOptions {
  std::vector<std::string> clips;     ///< by name, else by number from 0; empty: all
  std::optional<std::size_t> layers;  ///< of each model, from the first on; 0: no models
  std::vector<std::uint32_t> tracks;  ///< by id; empty: all
  /// Of the only clip that is kept; at most one of the two.
  struct Frames {
    std::uint64_t first = 0, last = 0;
  };
  std::optional<Frames> frames;
  struct Seconds {
    double from = 0;
    std::optional<double> to;  ///< > from; nothing: to the end
  };
  std::optional<Seconds> seconds;
  bool copies = true;  ///< of the static records
};

/// What remux() did.
struct RemuxReport {
  std::uint64_t segments = 0;
  /// Of a range: the frames of the source that were kept, which reach out to segment borders.
  std::optional<RemuxOptions::Frames> kept_frames;
};

/// Writes parts of a file as a file of its own; nothing is decoded or encoded. Records that nothing
/// refers to are dropped, unknown ones kept where their type allows it. A range of a clip is cut at
/// segment borders, outward, and starts anew with frame 0 and tick 0; it no longer loops. Reads
/// forward only; a range of a source that cannot seek, or that has no index, is held in memory. On
/// failure the sink holds rubbish. Errors: kNotFound for clips, tracks or frames that are not there
/// (names those that are), kInvalid for options that contradict each other or leave nothing; those
/// of source and sink.
Result<RemuxReport> remux(RewriteSource& source, container::ByteSink& sink,
                          const RemuxOptions& options);

}  // namespace relit::player
