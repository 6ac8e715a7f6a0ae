// SPDX-License-Identifier: MIT
#include "player/remux.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace relit::player {
namespace {

using namespace container;

using Frames = RemuxOptions::Frames;

template <class R, class Name>
std::string list(const std::vector<R>& records, Name&& name) {
  std::string all;
  for (const R& r : records) all += (all.empty() ? "" : ", ") + name(r);
  return all;
}

std::vector<std::uint32_t> tracks_of(const FileContents& contents) {
  std::vector<std::uint32_t> tracks;
  for (const PoseTrackRecord& pose : contents.pose_tracks) tracks.push_back(pose.track_id);
  for (const LayerRecord& layer : contents.layers) {
    tracks.push_back(layer.mantissa_track);
    if (layer.has_exponents) tracks.push_back(layer.exponent_track);
  }
  return tracks;
}

Result<std::uint32_t> find_clip(const FileContents& contents, const std::string& wanted) {
  const auto named = std::ranges::find(contents.clips, wanted, &ClipRecord::name);
  if (named != contents.clips.end()) return named->id;
  const bool number = !wanted.empty() && wanted.size() < 6 &&
                      wanted.find_first_not_of("0123456789") == std::string::npos;
  if (number && std::stoul(wanted) < contents.clips.size())
    return contents.clips[std::stoul(wanted)].id;
  return fail(ErrorCode::kNotFound, "no clip \"" + wanted + "\"; there are: " +
                                        list(contents.clips, [](auto& c) { return c.name; }));
}

Status keep_clips(FileContents& contents, const std::vector<std::string>& wanted) {
  if (wanted.empty()) return {};
  std::set<std::uint32_t> kept;
  for (const std::string& name : wanted) {
    RELIT_ASSIGN(const std::uint32_t id, find_clip(contents, name));
    kept.insert(id);
  }
  const std::vector<ClipRecord> all = contents.clips;
  for (const ClipRecord& clip : all)
    if (!kept.contains(clip.id)) drop_clip(contents, clip.id);
  return {};
}

void keep_layers(FileContents& contents, std::size_t count) {
  std::map<std::uint32_t, std::size_t> seen;
  std::erase_if(contents.layers, [&](const LayerRecord& l) { return seen[l.model_id]++ >= count; });
}

Status keep_tracks(FileContents& contents, const std::vector<std::uint32_t>& wanted) {
  if (wanted.empty()) return {};
  const std::set<std::uint32_t> kept(wanted.begin(), wanted.end());
  const auto there = tracks_of(contents);
  for (const std::uint32_t track : wanted) {
    if (std::ranges::find(there, track) == there.end())
      return fail(ErrorCode::kNotFound,
                  "no track " + std::to_string(track) + "; there are: " +
                      list(there, [](std::uint32_t t) { return std::to_string(t); }));
  }
  for (const LayerRecord& layer : contents.layers) {
    if (layer.has_exponents &&
        kept.contains(layer.mantissa_track) != kept.contains(layer.exponent_track))
      return fail(ErrorCode::kInvalid, "tracks " + std::to_string(layer.mantissa_track) + " and " +
                                           std::to_string(layer.exponent_track) +
                                           " are mantissas and exponents of one layer: keep both "
                                           "or none");
  }
  std::erase_if(contents.layers,
                [&](const LayerRecord& l) { return !kept.contains(l.mantissa_track); });
  std::erase_if(contents.pose_tracks,
                [&](const PoseTrackRecord& p) { return !kept.contains(p.track_id); });
  return {};
}

/// Meshes belong to the file; what they do not use, nobody does. Models that lost all layers go
/// too.
void drop_unused(FileContents& contents, const std::vector<LayerRecord>& layers_before) {
  const auto has_layers = [](const std::vector<LayerRecord>& layers, std::uint32_t model) {
    return std::ranges::find(layers, model, &LayerRecord::model_id) != layers.end();
  };
  std::erase_if(contents.models, [&](const ModelRecord& m) {
    return has_layers(layers_before, m.id) && !has_layers(contents.layers, m.id);
  });
  std::erase_if(contents.materials, [&](const MaterialRecord& m) {
    return std::ranges::find(contents.meshes, m.id, &MeshRecord::material_id) ==
           contents.meshes.end();
  });
  std::erase_if(contents.images, [&](const ImageRecord& image) {
    return std::ranges::none_of(contents.materials, [&](const MaterialRecord& m) {
      return m.image_id == static_cast<std::int64_t>(image.id);
    });
  });
}

/// Where a segment lies in its clip.
struct Place {
  std::uint64_t first_frame = 0, end_frame = 0;
  std::uint64_t first_tick = 0, end_tick = 0;
};

/// The part of a clip that is cut out.
struct Cut {
  std::uint32_t clip_id = 0;
  Place place;
};

/// Segments that overlap what is asked for, joined.
Result<Place> choose(const std::vector<Place>& places, const ClipRecord& clip,
                     const RemuxOptions& options) {
  const double rate =
      static_cast<double>(clip.tick_rate.num) / static_cast<double>(clip.tick_rate.den);
  const auto wanted = [&](const Place& p) {
    if (options.frames)
      return p.first_frame <= options.frames->last && p.end_frame > options.frames->first;
    const double from = options.seconds->from * rate;
    const double to = options.seconds->to.value_or(HUGE_VAL) * rate;
    return static_cast<double>(p.first_tick)<to&& static_cast<double>(p.end_tick)> from;
  };
  std::optional<Place> joined;
  for (const Place& p : places) {
    if (!wanted(p)) continue;
    if (!joined) joined = p;
    joined->end_frame = p.end_frame;
    joined->end_tick = p.end_tick;
  }
  if (joined) return *joined;
  return fail(ErrorCode::kNotFound, "nothing of clip \"" + clip.name +
                                        "\" lies in that range: it has " +
                                        std::to_string(clip.frame_count) + " frames in " +
                                        std::to_string(duration_s(clip)) + " s");
}

Place place_of(const SegmentRecord& s) {
  return {s.first_frame, s.first_frame + s.frame_count, s.first_tick,
          s.first_tick + duration_ticks(s)};
}

/// From an index: a segment ends where the next one of its clip starts. Nothing where there are
/// gaps, of which the index does not say when they begin.
std::optional<std::vector<Place>> places_in(const IndexRecord& index, const ClipRecord& clip) {
  std::vector<Place> places;
  for (const auto& e : index.segments) {
    if (e.clip_id != clip.id) continue;
    const std::uint64_t due = places.empty() ? 0 : places.back().end_frame;
    if (e.first_frame != due) return std::nullopt;
    if (!places.empty()) places.back().end_tick = e.first_tick;
    places.push_back({e.first_frame, e.first_frame + e.frame_count, e.first_tick, 0});
  }
  if (places.empty() || places.back().end_frame != clip.frame_count) return std::nullopt;
  places.back().end_tick = clip.duration_ticks;
  return places;
}

class Remux {
 public:
  Remux(RewriteSource& source, const RemuxOptions& options)
      : source_(source), options_(options), contents_(source.contents()) {}

  Result<RemuxReport> run(ByteSink& sink) {
    RELIT_TRY(keep_clips(contents_, options_.clips));
    if (options_.layers) keep_layers(contents_, *options_.layers);
    RELIT_TRY(keep_tracks(contents_, options_.tracks));
    drop_unused(contents_, source_.contents().layers);
    source_.set_wanted_tracks(tracks_of(contents_));
    RELIT_TRY(plan_cut());

    RELIT_ASSIGN(Writer writer, Writer::create(sink, contents_.header.writer,
                                               {.copies = options_.copies, .gaps = true}));
    RELIT_TRY(write_static(writer, contents_));
    RELIT_TRY(write_unknown(writer, std::exchange(unknown_, {})));
    for (WholeSegment& segment : held_) RELIT_TRY(write(writer, std::move(segment)));
    RELIT_TRY(write_unknown(writer, source_.take_unknown()));
    for (;;) {
      RELIT_ASSIGN(auto segment, source_.next());
      if (!segment) break;
      RELIT_TRY(write(writer, std::move(*segment)));
      RELIT_TRY(write_unknown(writer, source_.take_unknown()));
    }
    RELIT_TRY(write_unknown(writer, source_.take_unknown()));
    RELIT_TRY(writer.finish());
    return report_;
  }

 private:
  /// Finds the segments of a range, and makes the clip as long as they are.
  Status plan_cut() {
    unknown_ = source_.take_unknown();
    if (!options_.frames && !options_.seconds) return {};
    if (contents_.clips.size() != 1)
      return fail(ErrorCode::kInvalid, "a range is cut out of one clip; --clip chooses it among: " +
                                           list(contents_.clips, [](auto& c) { return c.name; }));
    ClipRecord& clip = contents_.clips.front();
    RELIT_ASSIGN(const auto places, find_places(clip));
    RELIT_ASSIGN(const Place place, choose(places, clip, options_));
    cut_ = Cut{clip.id, place};
    report_.kept_frames = Frames{place.first_frame, place.end_frame - 1};
    const std::uint64_t frames = place.end_frame - place.first_frame;
    if (frames != clip.frame_count) clip.loop = false;
    clip.frame_count = frames;
    clip.duration_ticks = place.end_tick - place.first_tick;
    return {};
  }

  /// The segments of the clip: from the index, or else by reading them all.
  Result<std::vector<Place>> find_places(const ClipRecord& clip) {
    if (const auto index = source_.read_index()) {
      auto places = places_in(*index, clip);
      if (places) return std::move(*places);
    }
    std::vector<Place> places;
    for (;;) {
      RELIT_ASSIGN(auto segment, source_.next());
      if (!segment) return places;
      if (segment->segment.clip_id != clip.id) continue;
      const Place place = place_of(segment->segment);
      places.push_back(place);
      if (choose({place}, clip, options_)) held_.push_back(std::move(*segment));
    }
  }

  Status write(Writer& writer, WholeSegment whole) {
    SegmentRecord& s = whole.segment;
    if (whole.chunks.empty()) return {};
    std::uint64_t frames = 0, ticks = 0;
    if (cut_) {
      const Place place = place_of(s);
      if (place.first_frame < cut_->place.first_frame || place.end_frame > cut_->place.end_frame)
        return {};
      frames = cut_->place.first_frame;
      ticks = cut_->place.first_tick;
    }
    for (ChunkRecord& chunk : whole.chunks)
      for (Packet& packet : chunk.packets) packet.pts -= static_cast<std::int64_t>(frames);
    ++report_.segments;
    return writer.write_segment({s.clip_id, s.first_frame - frames, s.frame_count,
                                 std::move(s.durations), s.first_tick - ticks},
                                std::move(whole.chunks));
  }

  RewriteSource& source_;
  const RemuxOptions& options_;
  FileContents contents_;
  std::vector<UnknownRecord> unknown_;  ///< of the static part
  std::vector<WholeSegment> held_;      ///< read before the static part could be written
  std::optional<Cut> cut_;
  RemuxReport report_;
};

}  // namespace

Result<RemuxReport> remux(RewriteSource& source, ByteSink& sink, const RemuxOptions& options) {
  return Remux(source, options).run(sink);
}

}  // namespace relit::player
