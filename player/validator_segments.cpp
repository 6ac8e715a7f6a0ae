// SPDX-License-Identifier: MIT
#include "player/validator_segments.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "container/record_codec.hpp"

namespace relit::player {

using namespace container;

namespace {

std::string text(std::uint64_t value) { return std::to_string(value); }

IndexRecord::Entry entry_of(const SegmentRecord& s, std::uint64_t offset) {
  return {s.index, s.clip_id, s.first_frame, s.frame_count, offset, s.first_tick};
}

}  // namespace

bool SegmentChecker::segment(const FindingPlace& place, std::span<const std::uint8_t> payload) {
  end_segment();
  auto parsed = parse_segment(payload);
  if (!parsed) {
    log_.add_parse_error(place, parsed.error());
    return false;
  }
  behind_lost_ = false;
  check_number(place, *parsed);
  check_frames(place, *parsed);
  check_tracks(place, *parsed);
  seen_.push_back(entry_of(*parsed, place.offset_bytes));
  segment_ = std::move(*parsed);
  segment_place_ = place;
  chunk_ = 0;
  return true;
}

void SegmentChecker::check_number(const FindingPlace& place, const SegmentRecord& segment) {
  const std::uint64_t due = last_number_ ? std::uint64_t{*last_number_} + 1 : 0;
  if (segment.index < due) {
    log_.add(
        "SEGM_INDEX", place,
        "the segment has number " + text(segment.index) + ", at least " + text(due) + " was due");
    return;
  }
  // A segment that was seen to be damaged has been reported already.
  if (segment.index > due && lost_.empty())
    log_.add("SEGM_INDEX_GAP", place,
             "the segment has number " + text(segment.index) + ", " + text(due) + " was due");
  last_number_ = segment.index;
}

void SegmentChecker::check_frames(const FindingPlace& place, const SegmentRecord& segment) {
  const auto frames = statics_.references().frame_count(segment.clip_id);
  if (!frames) {
    if (statics_.trusted())
      log_.add("SEGM_CLIP", place, "clip " + text(segment.clip_id) + " does not exist");
    return;
  }
  const std::uint64_t end = segment.first_frame + segment.frame_count;
  if (end > *frames)
    log_.add("SEGM_FRAMES", place,
             "the segment ends with frame " + text(end - 1) + ", clip " + text(segment.clip_id) +
                 " with frame " + text(*frames - 1));
  Progress& progress = progress_[segment.clip_id];
  const Progress before = progress;
  if (segment.first_frame < before.frames)
    log_.add("SEGM_OVERLAP", place,
             "the segment begins with frame " + text(segment.first_frame) +
                 ", the one before it of clip " + text(segment.clip_id) + " ends before frame " +
                 text(before.frames));
  if (segment.first_frame > before.frames) {
    progress.gap = true;
    if (lost_.empty())
      log_.add("SEGM_GAP", place,
               "frames " + text(before.frames) + " to " + text(segment.first_frame - 1) +
                   " of clip " + text(segment.clip_id) + " are left out");
  }
  check_ticks(place, segment, before);
  progress.frames = std::max(before.frames, end);
  progress.ticks = std::max(before.ticks, segment.first_tick + duration_ticks(segment));
}

void SegmentChecker::check_ticks(const FindingPlace& place, const SegmentRecord& segment,
                                 const Progress& before) {
  // What overlaps has been reported, and leaves nothing to compare with.
  if (segment.first_frame < before.frames) return;
  const std::uint64_t left_out = segment.first_frame - before.frames;
  const std::uint64_t least = before.ticks + left_out;
  if (segment.first_tick < least || (left_out == 0 && segment.first_tick != least))
    log_.add("SEGM_TICKS", place,
             "frame " + text(segment.first_frame) + " is shown at tick " +
                 text(segment.first_tick) + ", the frames before it last " +
                 (left_out == 0 ? "" : "at least ") + text(least));
  const std::uint64_t frames = *statics_.references().frame_count(segment.clip_id);
  const std::uint64_t ticks = *statics_.references().duration_ticks(segment.clip_id);
  const std::uint64_t end_frame = segment.first_frame + segment.frame_count;
  const std::uint64_t end_tick = segment.first_tick + duration_ticks(segment);
  if (end_frame > frames) return;
  if (end_tick + (frames - end_frame) > ticks || (end_frame == frames && end_tick != ticks))
    log_.add("SEGM_DURATION", place,
             "frame " + text(end_frame - 1) + " ends at tick " + text(end_tick) + ", clip " +
                 text(segment.clip_id) + " of " + text(frames) + " frames at tick " + text(ticks));
}

void SegmentChecker::check_tracks(const FindingPlace& place, const SegmentRecord& segment) {
  if (!statics_.trusted() || !statics_.references().frame_count(segment.clip_id)) return;
  const auto declared = statics_.references().tracks(segment.clip_id);
  std::vector<std::ptrdiff_t> order;
  for (const auto& chunk : segment.chunks) {
    const auto at = std::ranges::find(declared, chunk.track_id);
    if (at == declared.end())
      log_.add("SEGM_UNKNOWN_TRACK", place,
               "clip " + text(segment.clip_id) + " has no track " + text(chunk.track_id));
    else
      order.push_back(at - declared.begin());
  }
  for (std::size_t i = 0; i < declared.size(); ++i) {
    if (std::ranges::find(order, static_cast<std::ptrdiff_t>(i)) == order.end())
      log_.add("SEGM_MISSING_TRACK", place,
               "segment " + text(segment.index) + " has no chunk for track " + text(declared[i]));
  }
  if (!std::ranges::is_sorted(order))
    log_.add("SEGM_CHUNK_ORDER", place,
             "the chunks of segment " + text(segment.index) +
                 " stand in another order than POSE and each LAYR declare their tracks");
}

bool SegmentChecker::expect_chunk(const FindingPlace& place, std::uint64_t record_bytes) {
  const auto& due = segment_->chunks[chunk_];
  if (place.type == types::kChunk && record_bytes == due.chunk_bytes) return true;
  log_.add("CHNK_ANNOUNCED", place,
           "segment " + text(segment_->index) + " announces a chunk of " + text(due.chunk_bytes) +
               " bytes here, for track " + text(due.track_id) + "; there is '" +
               type_name(place.type) + "' of " + text(record_bytes) + " bytes");
  if (place.type != types::kChunk) return false;
  // Where a chunk in between is missing, the length tells which one this is.
  for (std::size_t k = chunk_; k < segment_->chunks.size(); ++k) {
    if (segment_->chunks[k].chunk_bytes != record_bytes) continue;
    chunk_ = k;
    break;
  }
  return true;
}

void SegmentChecker::chunk(const FindingPlace& place,
                           std::optional<std::span<const std::uint8_t>> payload) {
  const std::uint32_t track = segment_->chunks[chunk_++].track_id;
  if (!payload) return;
  auto parsed = parse_chunk(*payload);
  if (!parsed) {
    log_.add_parse_error(place, parsed.error());
    return;
  }
  if (parsed->track_id != track || parsed->segment_index != segment_->index) {
    log_.add("CHNK_ANNOUNCED", place,
             "the chunk is of track " + text(parsed->track_id) + " in segment " +
                 text(parsed->segment_index) + ", announced is track " + text(track) +
                 " in segment " + text(segment_->index));
    return;
  }
  if (!check_packets(place, *parsed) || tracks_ == nullptr) return;
  tracks_->check(place, *segment_, std::move(*parsed));
}

bool SegmentChecker::check_packets(const FindingPlace& place, const ChunkRecord& chunk) {
  const std::string track = "track " + text(chunk.track_id);
  const auto first = static_cast<std::int64_t>(segment_->first_frame);
  const std::int64_t end = first + segment_->frame_count;
  if (!chunk.packets.front().key)
    log_.add(
        "CHNK_KEY", place,
        "the first packet of " + track + " in segment " + text(segment_->index) + " is not a key");
  const auto outside = std::ranges::find_if(
      chunk.packets, [&](const Packet& p) { return p.pts < first || p.pts >= end; });
  if (outside != chunk.packets.end())
    log_.add("CHNK_PTS", place,
             track + " has a packet of frame " + std::to_string(outside->pts) +
                 ", the segment has frames " + std::to_string(first) + " to " +
                 std::to_string(end - 1));
  else if (chunk.packets.front().pts != first)
    log_.add("CHNK_PTS", place,
             "the first packet of " + track + " is of frame " +
                 std::to_string(chunk.packets.front().pts) + ", the segment begins with frame " +
                 std::to_string(first));
  else
    return chunk.packets.front().key;
  return false;
}

void SegmentChecker::end_segment() {
  if (segment_ && tracks_ != nullptr) tracks_->end_segment(segment_place_, *segment_);
  segment_.reset();
}

void SegmentChecker::abandon() { end_segment(); }

void SegmentChecker::note_loss(std::uint64_t begin, std::uint64_t end) {
  // In the order of the file, so that the last range that begins before a place tells of all.
  lost_.emplace_back(begin, lost_.empty() ? end : std::max(end, lost_.back().second));
}

void SegmentChecker::note_lost_segment(const FindingPlace& place, std::uint64_t record_bytes) {
  end_segment();
  behind_lost_ = true;
  note_loss(place.offset_bytes, place.offset_bytes + record_bytes);
}

bool SegmentChecker::lost_between(std::uint64_t begin, std::uint64_t end) const {
  const auto behind =
      std::ranges::lower_bound(lost_, end, {}, [](auto& range) { return range.first; });
  return behind != lost_.begin() && begin < std::prev(behind)->second;
}

void SegmentChecker::index(const FindingPlace& place, const IndexRecord& record) {
  std::size_t next = 0;
  for (const IndexRecord::Entry& entry : record.segments) {
    // Both lists rise by offset.
    for (; next < seen_.size() && seen_[next].offset < entry.offset; ++next)
      log_.add("INDX_SEGMENT", {seen_[next].offset, types::kSegment},
               "segment " + text(seen_[next].segment_index) + " is not in the index");
    const bool here = next < seen_.size() && seen_[next].offset == entry.offset;
    if (here && seen_[next++] == entry) continue;
    if (!here && lost_between(entry.offset, entry.offset + 1)) continue;
    log_.add("INDX_ENTRY", place,
             "the entry of segment " + text(entry.segment_index) + " at byte " +
                 text(entry.offset) +
                 (here ? " does not say what the segment says" : ": there is no segment"));
  }
  for (; next < seen_.size(); ++next)
    log_.add("INDX_SEGMENT", {seen_[next].offset, types::kSegment},
             "segment " + text(seen_[next].segment_index) + " is not in the index");
}

void SegmentChecker::finish(const FindingPlace& end, bool complete) {
  if (inside())
    log_.add("FRAMING_TRUNCATED", end,
             "the file ends inside segment " + text(segment_->index) + ", before chunk " +
                 text(chunk_ + 1) + " of " + text(segment_->chunks.size()));
  end_segment();
  if (!complete || !lost_.empty() || !statics_.trusted()) return;
  for (const auto& clip : statics_.clips()) {
    const std::uint64_t frames = progress_[clip.record.id].frames;
    if (frames >= clip.record.frame_count || statics_.references().tracks(clip.record.id).empty())
      continue;
    log_.add("CLIP_INCOMPLETE", clip.place,
             "clip " + text(clip.record.id) + " has segments up to frame " + text(frames) + " of " +
                 text(clip.record.frame_count));
  }
}

}  // namespace relit::player
