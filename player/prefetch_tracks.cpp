// SPDX-License-Identifier: MIT
// The strands of a Prefetcher: one for each track, a frame a step.
#include <algorithm>

#include "container/base/out_of_memory.hpp"
#include "player/prefetch_state.hpp"

namespace relit::player {

using State = Prefetcher::State;

Result<decoders::TrackDecoder> State::open_decoder(const Track& track) const {
  auto decoder = decoders::TrackDecoder::open(track.format, track.decoding);
  if (!decoder) return demuxer.in_file(decoder.error());
  return decoder;
}

// Threads go to segments before they go to pictures: decoders that each have a segment to
// themselves never wait for one another, and small pictures are decoded in less time than it takes
// to hand them to a thread. For that the ring has to reach over as many segments.
void State::share_out_threads(const PrefetchOptions& options) {
  std::size_t layer_count = 0, frame_bytes = 1;
  for (const auto& track : tracks) {
    const auto layer = static_cast<std::size_t>(track->about.layer);
    if (track->pose || (!options.layers.empty() && options.layers[layer] == 0)) continue;
    frame_bytes += track->picture_bytes;
    if (!track->about.exponents) ++layer_count;
  }
  const auto& rate = demuxer.clip().tick_rate;
  const std::uint64_t half_a_second = std::clamp<std::uint64_t>(
      static_cast<std::uint64_t>(rate.num / (2 * std::max<std::int64_t>(rate.den, 1))), 1,
      demuxer.clip().frame_count);
  const std::uint64_t ahead = std::min<std::uint64_t>(ring_limit / frame_bytes, ring.size());
  const auto workers = static_cast<std::size_t>(pool->threads());
  std::size_t lanes = 1, threads = static_cast<std::size_t>(std::max(options.threads, 1));
  if (options.threads == 0) {
    const auto reach = static_cast<std::size_t>(ahead / half_a_second);
    if (options.decoder.empty()) lanes = std::clamp<std::size_t>(reach, 1, workers);
    threads = std::max<std::size_t>(workers / (lanes * std::max<std::size_t>(layer_count, 1)), 1);
  }
  for (std::size_t t = 0; t < tracks.size(); ++t) {
    Track& track = *tracks[t];
    if (!track.pose && !track.about.exponents) {
      track.decoding.threads = static_cast<int>(threads);
      track.decoding.name = options.decoder;
    }
    track.about.decoders = track.pose ? 1 : static_cast<int>(lanes);
    for (std::size_t turn = 0; turn < (track.pose ? 1 : lanes); ++turn) {
      track.lanes.push_back(std::make_unique<Lane>());
      Lane& lane = *track.lanes.back();
      lane.track = t;
      lane.turn = turn;
      lane.strand =
          std::make_unique<WorkerPool::Strand>(pool, [this, &lane] { return run_strand(lane); });
    }
  }
}

Status State::check_choice(std::span<const std::uint8_t> chosen) const {
  const std::size_t count = demuxer.layers().size();
  if (chosen.size() == count) return {};
  return fail(ErrorCode::kInvalid, "one choice for each of the " + std::to_string(count) +
                                       " layers is needed, got " + std::to_string(chosen.size()));
}

Status State::open_tracks(const PrefetchOptions& options, std::shared_ptr<WorkerPool> workers) {
  pool = std::move(workers);
  memory = options.memory ? options.memory : std::make_shared<decoders::PictureMemory>();
  const auto add = [&](std::uint32_t id, int layer, bool exponents) -> Track& {
    tracks.push_back(std::make_unique<Track>());
    tracks.back()->about = {id, layer, exponents};
    tracks.back()->decoding.memory = memory;
    return *tracks.back();
  };
  const auto add_video = [&](const decoders::VideoFormat& format, int layer, bool exponents) {
    Track& track = add(format.track_id, layer, exponents);
    track.format = format;
    const auto bytes = decoders::picture_buffer_bytes(format);
    track.picture_bytes = bytes ? static_cast<std::size_t>(*bytes) : 0;
  };
  Track& pose = add(demuxer.pose_record().track_id, -1, false);
  pose.pose = true;
  RELIT_ASSIGN(pose.poses, demuxer.open_poses());
  const auto& layers = demuxer.layers();
  for (std::size_t i = 0; i < layers.size() && planes; ++i) {
    RELIT_TRY(decoders::check_layer(demuxer.model(), layers[i]));
    add_video(decoders::mantissa_format(layers[i]), static_cast<int>(i), false);
    if (!layers[i].has_exponents) continue;
    add_video(decoders::exponent_format(layers[i]), static_cast<int>(i), true);
  }
  if (!options.layers.empty()) RELIT_TRY(check_choice(options.layers));
  share_out_threads(options);
  return {};
}

void State::note_damage(const Error& damage) {
  last_damage = damage;
  if (first_damage.empty()) first_damage = demuxer.name() + ": " + damage.message;
}

/// Gives the chunks of segments before this one back.
void State::drop_chunks(Lane& lane, std::uint64_t before_no) {
  while (!lane.inbox.empty() && lane.inbox.front().segment_no < before_no) {
    packet_bytes -= container::storage_bytes(lane.inbox.front().record);
    returned.push_back(std::move(lane.inbox.front().record));
    lane.inbox.erase(lane.inbox.begin());
  }
}

/// Brings the strand's own state in line with the others'. False: its decoder is to go.
bool State::begin_step(Lane& lane, std::unique_lock<std::mutex>& lock) {
  Track& track = *tracks[lane.track];
  if (lane.incoming) {
    lane.decoder = std::exchange(lane.incoming, std::nullopt);
    lane.segment_no = 0;
    lane.pictures = 0;
  }
  if (lane.epoch != demux_epoch) {
    lane.epoch = demux_epoch;
    lane.cursor = head;
    lane.segment_no = 0;
    lane.last.clear();
    if (track.poses) track.poses->forget_all();
  }
  lane.cursor = std::max(lane.cursor, head);
  if (track.enabled || !lane.decoder) return true;
  const bool used = std::ranges::any_of(segments,
                                        [&](const Segment& s) {
                                          return (*s.wanted)[lane.track] != 0 &&
                                                 s.no % track.lanes.size() == lane.turn;
                                        }) ||
                    find_work(lane);
  if (used) return true;
  drop_chunks(lane, last_no + 1);
  packet_bytes -= std::exchange(lane.held_bytes, 0);
  lock.unlock();
  lane.last.clear();
  lane.decoder.reset();
  lock.lock();
  return false;
}

/// Moves the cursor to the next frame that lacks this lane's picture.
bool State::find_work(Lane& lane) {
  const std::size_t lanes = tracks[lane.track]->lanes.size();
  for (; lane.cursor < tail; ++lane.cursor) {
    const Slot& slot = at(lane.cursor);
    const Part& part = slot.parts[lane.track];
    if (part.wanted && !part.done && slot.segment_no % lanes == lane.turn) return true;
  }
  return false;
}

/// Whether the frame's chunk is in the decoder, or at hand in `lane.chunk`, or will never come.
bool State::find_chunk(Lane& lane, const Slot& slot) {
  drop_chunks(lane, slot.segment_no);
  if (lane.segment_no == slot.segment_no) return true;
  if (!lane.inbox.empty() && lane.inbox.front().segment_no == slot.segment_no) {
    std::swap(lane.chunk, lane.inbox.front());
    lane.inbox.erase(lane.inbox.begin());
    if (!tracks[lane.track]->pose) lane.held_bytes = container::storage_bytes(lane.chunk.record);
    return true;
  }
  if (closed_no >= slot.segment_no) return true;
  starving = true;
  work.notify_one();
  return false;
}

Status State::load_chunk(Lane& lane) {
  Chunk& chunk = lane.chunk;
  Track& track = *tracks[lane.track];
  lane.segment_no = chunk.segment_no;
  if (!track.pose) {
    if (!lane.decoder) {
      RELIT_ASSIGN(lane.decoder, open_decoder(track));
    }
    container::SegmentRecord segment;
    segment.index = chunk.segment_index;
    segment.first_frame = chunk.first_frame;
    segment.frame_count = chunk.frame_count;
    return lane.decoder->replace_chunk(segment, chunk.record);
  }
  if (!track.poses || chunk.record.packets.empty()) return {};
  const container::Packet& packet = chunk.record.packets.front();
  const std::span<const std::uint8_t> bytes(chunk.record.data.data() + packet.offset,
                                            static_cast<std::size_t>(packet.size));
  // Frames of the segment before are over, and of the next lap's first segment the old copy is.
  RELIT_TRY(track.poses->add_packet(bytes, chunk.first_frame, chunk.frame_count));
  track.poses->forget_except(chunk.first_frame);
  return {};
}

Status State::decode_picture(Lane& lane, std::uint64_t index, decoders::VideoFrame& picture) {
  if (!lane.decoder) return fail(ErrorCode::kNotFound, "the track's decoder is not open");
  RELIT_ASSIGN(const decoders::VideoFrame* decoded, lane.decoder->picture(index));
  picture = *decoded;
  if (picture.empty()) {
    return fail(ErrorCode::kOutOfMemory, "no memory for a reference to a picture");
  }
  return {};
}

Status State::decode_pose(Track& track, std::uint64_t index) {
  return track.poses->sample(static_cast<double>(index), track.scratch);
}

namespace {

std::size_t pose_bytes(const decoders::Pose& pose) {
  std::size_t bytes = (pose.palette.capacity() + pose.world.capacity()) * sizeof(glm::mat4x3) +
                      pose.morph_weights.capacity() * sizeof(float);
  for (const auto& mesh : pose.vertices) bytes += mesh.capacity() * sizeof(glm::vec3);
  return bytes;
}

}  // namespace

void State::finish_part(Lane& lane, std::uint64_t seq, const Status& decoded,
                        decoders::VideoFrame& picture) {
  if (!decoded) note_damage(decoded.error());
  if (lane.epoch != epoch || seq < head) return;  // nobody waits for it any more
  Track& track = *tracks[lane.track];
  Slot& slot = at(seq);
  Part& part = slot.parts[lane.track];
  part.done = true;
  pending_bytes -= std::exchange(part.expected, 0);
  if (!decoded) {
    slot.lost = true;
  } else if (track.pose) {
    std::swap(slot.frame.pose, track.scratch);
    part.charged = track.picture_bytes = pose_bytes(slot.frame.pose);
  } else {
    part.shares_previous = picture.same_picture(lane.last) && lane.last_seq + 1 == seq &&
                           seq > head && at(seq - 1).parts[lane.track].done;
    track.picture_bytes = picture.buffer_bytes();
    part.charged = part.shares_previous ? 0 : track.picture_bytes;
    lane.last_seq = seq;
    std::swap(lane.last, picture);
    part.picture = lane.last;
  }
  ring_bytes += part.charged;
  note_peaks();
  if (--slot.missing == 0 && !slot.lost) ++counts.decoded_frames;
  if (ready(slot)) changed.notify_all();
}

bool State::run_strand(Lane& lane) {
  try {
    return step(lane);
  } catch (const std::bad_alloc&) {
    const std::lock_guard lock(mutex);
    fail_with(out_of_memory("decoding ahead"));
    return false;
  }
}

bool State::step(Lane& lane) {
  Track& track = *tracks[lane.track];
  std::unique_lock lock(mutex);
  if (closing || demux_epoch != epoch || !begin_step(lane, lock)) return false;
  if (!find_work(lane)) return false;
  const Slot& slot = at(lane.cursor);
  if (!find_chunk(lane, slot)) return false;
  const std::uint64_t seq = lane.cursor, index = slot.index;
  const std::uint64_t no = slot.segment_no, apart = slot.every;
  lock.unlock();

  if (lane.decoder) lane.decoder->show_every(apart);
  const auto began = Clock::now();
  Status loaded;
  const bool fresh = lane.chunk.segment_no == no && lane.segment_no != no;
  decoders::VideoFrame picture;
  const Status decoded = catch_out_of_memory("decoding ahead", [&]() -> Status {
    if (fresh) loaded = load_chunk(lane);
    if (track.pose) return decode_pose(track, index);
    if (lane.segment_no != no) {
      return fail(ErrorCode::kNotFound, "track " + std::to_string(track.about.track_id) +
                                            ", frame " + std::to_string(index) +
                                            ": its chunk is missing");
    }
    return decode_picture(lane, index, picture);
  });
  const std::chrono::duration<double> took = Clock::now() - began;

  lock.lock();
  counts.decode_s += took.count();
  if (lane.decoder) {
    const std::uint64_t pictures = lane.decoder->pictures();
    counts.decoded_pictures += pictures - std::exchange(lane.pictures, pictures);
  } else if (track.pose && fresh) {
    counts.pose_bytes = track.poses->memory_bytes();
  }
  if (!loaded) note_damage(loaded.error());
  if (fresh) {
    packet_bytes -= container::storage_bytes(lane.chunk.record);
    returned.push_back(std::move(lane.chunk.record));
    work.notify_one();
  }
  if (lane.decoder && !track.noted && !lane.decoder->decoder().note().empty()) {
    track.noted = true;
    counts.notes.push_back(lane.decoder->decoder().note());
  }
  finish_part(lane, seq, decoded, picture);
  lane.cursor = std::max(lane.cursor, seq + 1);
  const std::uint64_t before = tail;
  admit();
  if (tail != before) wake();
  return true;
}

}  // namespace relit::player
