// SPDX-License-Identifier: MIT
// What may be left out, repeated and added, and values at their limits.
#include <cfloat>

#include "tests/conformance/making.hpp"

namespace relit::conformance {

using namespace container;

namespace {

/// A vector made by changing the plain figure, without a finding.
void good(Vectors& vectors, const char* name, const char* description,
          std::function<void(Draft&)> change, const FigureOptions& options = plain_figure()) {
  from_draft(vectors, name, description, whole(), std::move(change), options);
}

FigureOptions frames(int count, int segment = 2) {
  FigureOptions o = plain_figure();
  o.frames = count;
  o.coding.segment_frames = segment;
  return o;
}

void add_omissions(Vectors& vectors) {
  good(vectors, "minimal", "all that a player needs, three frames in two segments", [](Draft&) {});
  from_draft(vectors, "without-index", "no INDX: found by reading forward", noted({"INDX_MISSING"}),
             [](Draft& d) { d.index = false; });
  from_draft(vectors, "without-copies", "no copies of the static part", noted({"COPY_MISSING"}),
             [](Draft& d) { d.copies = false; });
  from_draft(vectors, "live", "neither copies nor INDX nor FEND, as a live stream",
             noted({"FEND_MISSING"}), [](Draft& d) { d.copies = d.index = d.end = false; });
  good(vectors, "without-segments", "still meshes and nothing to play",
       [](Draft& d) { d.segments.clear(), d.poses.clear(), d.models.clear(), d.layers.clear(); });
  good(vectors, "clip-alone", "HEAD and CLIP, nothing else", [](Draft& d) {
    Draft bare;
    bare.clips = d.clips;
    d = bare;
  });
  good(vectors, "without-model", "poses only", [](Draft& d) {
    d.models.clear(), d.layers.clear();
    for (DraftSegment& s : d.segments) s.chunks.resize(1);
  });
  good(vectors, "without-pose", "stands as SKEL says", [](Draft& d) {
    d.poses.clear();
    for (DraftSegment& s : d.segments) s.chunks.erase(s.chunks.begin());
  });
  good(vectors, "without-image", "a material of one colour", [](Draft& d) {
    d.images.clear();
    d.materials.front().image_id = -1;
  });
  good(vectors, "without-rig", "a mesh without joints, no skeleton, no pose", [](Draft& d) {
    d.meshes = {quad(0)};
    d.skeleton.reset();
    d.poses.clear();
    for (DraftSegment& s : d.segments) s.chunks.erase(s.chunks.begin());
  });
  good(vectors, "without-layers", "a model of its mean alone", [](Draft& d) {
    d.layers.clear();
    for (DraftSegment& s : d.segments) s.chunks.resize(1);
  });
}

void add_times(Vectors& vectors) {
  good(
      vectors, "single-frame", "one frame", [](Draft&) {}, frames(1));
  good(
      vectors, "one-segment", "all frames in one segment", [](Draft&) {}, frames(5, 8));
  good(
      vectors, "segments-of-one", "a segment for every frame", [](Draft&) {}, frames(4, 1));
  good(
      vectors, "durations", "frames that last 1, 50, 2, 7 and 1 ticks",
      [](Draft& d) {
        set_durations(d, {1, 50, 2, 7, 1});
      },
      frames(5));
  good(
      vectors, "durations-in-one-segment", "one segment states durations, the others none",
      [](Draft& d) {
        set_durations(d, {1, 1, 3, 2, 1});
        d.segments[0].record.durations.clear();
        d.segments[2].record.durations.clear();
      },
      frames(5));
  good(vectors, "tick-rate-ntsc", "30000/1001 ticks a second, looping", [](Draft& d) {
    d.clips.front().tick_rate = {30000, 1001};
    d.clips.front().loop = true;
  });
  good(vectors, "tick-rate-not-lowest", "100/4 ticks a second", [](Draft& d) {
    d.clips.front().tick_rate = {100, 4};
  });
}

}  // namespace

void add_structures(Vectors& vectors) {
  add_omissions(vectors);
  add_times(vectors);
  add_extremes(vectors);
}

}  // namespace relit::conformance
