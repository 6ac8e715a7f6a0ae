// SPDX-License-Identifier: MIT
// The strands of a Prefetcher: one for each track, a frame a step.
#include <algorithm>

#include "container/base/out_of_memory.hpp"
#include "player/prefetch_state.hpp"

namespace relit::player {

using State = Prefetcher::State;

Status State::open_decoder(Track& track, std::size_t wanted_count) {
  decoders::VideoDecoderOptions options;
  options.memory = memory;
  if (!track.about.exponents) {
    const int shared = pool->threads() / static_cast<int>(std::max<std::size_t>(wanted_count, 1));
    options.threads = threads > 0 ? threads : std::max(shared, 1);
    options.name = decoder_name;
  }
  auto decoder = decoders::TrackDecoder::open(track.format, options);
  if (!decoder) return demuxer.in_file(decoder.error());
  track.incoming.emplace(std::move(*decoder));
  const auto bytes = decoders::picture_buffer_bytes(track.format);
  track.picture_bytes = bytes ? static_cast<std::size_t>(*bytes) : 0;
  return {};
}

Status State::open_tracks(const PrefetchOptions& options, std::shared_ptr<WorkerPool> workers) {
  pool = std::move(workers);
  memory = options.memory ? options.memory : std::make_shared<decoders::PictureMemory>();
  const auto add = [&](std::uint32_t id, int layer, bool exponents) -> Track& {
    tracks.push_back(std::make_unique<Track>());
    tracks.back()->about = {id, layer, exponents, 0};
    return *tracks.back();
  };
  Track& pose = add(demuxer.pose_record().track_id, -1, false);
  pose.pose = true;
  RELIT_ASSIGN(pose.poses, demuxer.open_poses());
  const auto& layers = demuxer.layers();
  for (std::size_t i = 0; i < layers.size() && planes; ++i) {
    RELIT_TRY(decoders::check_layer(demuxer.model(), layers[i]));
    add(layers[i].mantissa_track, static_cast<int>(i), false).format =
        decoders::mantissa_format(layers[i]);
    if (!layers[i].has_exponents) continue;
    add(layers[i].exponent_track, static_cast<int>(i), true).format =
        decoders::exponent_format(layers[i]);
  }
  for (std::size_t t = 0; t < tracks.size(); ++t) {
    tracks[t]->strand =
        std::make_unique<WorkerPool::Strand>(pool, [this, t] { return run_strand(t); });
  }
  return options.layers.empty() || options.layers.size() == layers.size()
             ? Status{}
             : fail(ErrorCode::kInvalid,
                    "one choice for each of the " + std::to_string(layers.size()) +
                        " layers is needed, got " + std::to_string(options.layers.size()));
}

void State::note_damage(const Error& damage) {
  last_damage = damage;
  if (first_damage.empty()) first_damage = demuxer.name() + ": " + damage.message;
}

/// Gives the chunks of segments before this one back.
void State::drop_chunks(Track& track, std::uint64_t before_no) {
  while (!track.inbox.empty() && track.inbox.front().segment_no < before_no) {
    packet_bytes -= container::storage_bytes(track.inbox.front().record);
    returned.push_back(std::move(track.inbox.front().record));
    track.inbox.erase(track.inbox.begin());
  }
}

/// Brings the strand's own state in line with the others'. False: its decoder is to go.
bool State::begin_step(Track& track, std::unique_lock<std::mutex>& lock) {
  if (track.incoming) {
    track.decoder = std::exchange(track.incoming, std::nullopt);
    track.segment_no = 0;
    track.pictures = 0;
  }
  if (track.epoch != demux_epoch) {
    track.epoch = demux_epoch;
    track.cursor = head;
    track.segment_no = 0;
    track.last.clear();
    if (track.poses) track.poses->forget_all();
  }
  track.cursor = std::max(track.cursor, head);
  if (track.enabled || !track.decoder) return true;
  const auto number = static_cast<std::size_t>(
      std::ranges::find_if(tracks, [&](const auto& t) { return t.get() == &track; }) -
      tracks.begin());
  const bool used =
      std::ranges::any_of(segments, [&](const Segment& s) { return (*s.wanted)[number] != 0; }) ||
      find_work(track, number);
  if (used) return true;
  drop_chunks(track, last_no + 1);
  packet_bytes -= std::exchange(track.held_bytes, 0);
  lock.unlock();
  track.last.clear();
  track.decoder.reset();
  lock.lock();
  return false;
}

/// Moves the cursor to the next frame that lacks this track.
bool State::find_work(Track& track, std::size_t number) {
  for (; track.cursor < tail; ++track.cursor) {
    const Part& part = at(track.cursor).parts[number];
    if (part.wanted && !part.done) return true;
  }
  return false;
}

/// Whether the frame's chunk is in the decoder, or at hand in `track.chunk`, or will never come.
bool State::find_chunk(Track& track, const Slot& slot) {
  drop_chunks(track, slot.segment_no);
  if (track.segment_no == slot.segment_no) return true;
  if (!track.inbox.empty() && track.inbox.front().segment_no == slot.segment_no) {
    std::swap(track.chunk, track.inbox.front());
    track.inbox.erase(track.inbox.begin());
    if (!track.pose) track.held_bytes = container::storage_bytes(track.chunk.record);
    return true;
  }
  if (closed_no >= slot.segment_no) return true;
  starving = true;
  work.notify_one();
  return false;
}

Status State::load_chunk(Track& track) {
  Chunk& chunk = track.chunk;
  track.segment_no = chunk.segment_no;
  if (track.decoder) {
    container::SegmentRecord segment;
    segment.index = chunk.segment_index;
    segment.first_frame = chunk.first_frame;
    segment.frame_count = chunk.frame_count;
    return track.decoder->replace_chunk(segment, chunk.record);
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

Status State::decode_picture(Track& track, std::uint64_t index, decoders::VideoFrame& picture) {
  if (!track.decoder) return fail(ErrorCode::kNotFound, "the track's decoder is not open");
  RELIT_ASSIGN(const decoders::VideoFrame* decoded, track.decoder->picture(index));
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

void State::finish_part(Track& track, std::size_t number, std::uint64_t seq, const Status& decoded,
                        decoders::VideoFrame& picture) {
  if (!decoded) note_damage(decoded.error());
  if (track.epoch != epoch || seq < head) return;  // nobody waits for it any more
  Slot& slot = at(seq);
  Part& part = slot.parts[number];
  part.done = true;
  pending_bytes -= std::exchange(part.expected, 0);
  if (!decoded) {
    slot.lost = true;
  } else if (track.pose) {
    std::swap(slot.frame.pose, track.scratch);
    part.charged = track.picture_bytes = pose_bytes(slot.frame.pose);
  } else {
    part.shares_previous = picture.same_picture(track.last) && track.last_seq + 1 == seq &&
                           seq > head && at(seq - 1).parts[number].done;
    track.picture_bytes = picture.buffer_bytes();
    part.charged = part.shares_previous ? 0 : track.picture_bytes;
    track.last_seq = seq;
    std::swap(track.last, picture);
    part.picture = track.last;
  }
  ring_bytes += part.charged;
  note_peaks();
  if (--slot.missing == 0 && !slot.lost) ++counts.decoded_frames;
  if (ready(slot)) changed.notify_all();
}

bool State::run_strand(std::size_t number) {
  try {
    return step(number);
  } catch (const std::bad_alloc&) {
    const std::lock_guard lock(mutex);
    fail_with(out_of_memory("decoding ahead"));
    return false;
  }
}

bool State::step(std::size_t number) {
  Track& track = *tracks[number];
  std::unique_lock lock(mutex);
  if (closing || demux_epoch != epoch || !begin_step(track, lock)) return false;
  if (!find_work(track, number)) return false;
  const Slot& slot = at(track.cursor);
  if (!find_chunk(track, slot)) return false;
  const std::uint64_t seq = track.cursor, index = slot.index;
  const std::uint64_t no = slot.segment_no, apart = slot.every;
  lock.unlock();

  if (track.decoder) track.decoder->show_every(apart);
  const auto began = Clock::now();
  Status loaded;
  const bool fresh = track.chunk.segment_no == no && track.segment_no != no;
  decoders::VideoFrame picture;
  const Status decoded = catch_out_of_memory("decoding ahead", [&]() -> Status {
    if (fresh) loaded = load_chunk(track);
    if (track.pose) return decode_pose(track, index);
    if (track.segment_no != no) {
      return fail(ErrorCode::kNotFound, "track " + std::to_string(track.about.track_id) +
                                            ", frame " + std::to_string(index) +
                                            ": its chunk is missing");
    }
    return decode_picture(track, index, picture);
  });
  const std::chrono::duration<double> took = Clock::now() - began;

  lock.lock();
  counts.decode_s += took.count();
  if (track.decoder) {
    const std::uint64_t pictures = track.decoder->pictures();
    counts.decoded_pictures += pictures - std::exchange(track.pictures, pictures);
  } else if (track.pose && fresh) {
    counts.pose_bytes = track.poses->memory_bytes();
  }
  if (!loaded) note_damage(loaded.error());
  if (fresh) {
    packet_bytes -= container::storage_bytes(track.chunk.record);
    returned.push_back(std::move(track.chunk.record));
    work.notify_one();
  }
  if (track.decoder && !track.noted && !track.decoder->decoder().note().empty()) {
    track.noted = true;
    counts.notes.push_back(track.decoder->decoder().note());
  }
  finish_part(track, number, seq, decoded, picture);
  track.cursor = std::max(track.cursor, seq + 1);
  const std::uint64_t before = tail;
  admit();
  if (tail != before) wake();
  return true;
}

}  // namespace relit::player
