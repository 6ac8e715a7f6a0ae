// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "player/prefetcher.hpp"

namespace relit::player {

/// What the threads of a Prefetcher share. Everything is guarded by `mutex` unless it says whose it
/// is. Frames are numbered twice: by their place in the clip, and by `seq`, their place in the
/// order of playback since the beginning, which loops make another one.
struct Prefetcher::State {
  using Clock = std::chrono::steady_clock;
  using Wanted = std::shared_ptr<const std::vector<std::uint8_t>>;  ///< by track

  /// A track's share in a frame.
  struct Part {
    bool wanted = false;
    bool done = false;
    bool taken = false;  ///< the picture has gone to the frame's view
    bool shares_previous =
        false;                 ///< the picture is the one of the frame before, and charged there
    std::size_t charged = 0;   ///< bytes
    std::size_t expected = 0;  ///< bytes, until it is done
    decoders::VideoFrame picture;
  };
  /// A place of the ring.
  struct Slot {
    std::uint64_t index = 0;       ///< in the clip
    std::uint64_t until = 0;       ///< the frames before this one, and from `index` on, are this
    std::uint64_t every = 1;       ///< set_every() when it was admitted
    std::uint64_t segment_no = 0;  ///< see Segment
    std::vector<Part> parts;       ///< by track
    std::size_t missing = 0;       ///< parts that are wanted and not done
    bool first = false;            ///< after a start or a jump
    bool lost = false;             ///< damage hit it
    bool counted = false;          ///< as lost
    bool laid_out = false;         ///< `frame` is about this frame
    ClipFrame frame;
    [[nodiscard]] bool good() const { return missing == 0 && !lost; }
    [[nodiscard]] bool shows(std::uint64_t k) const { return index <= k && k < until; }
  };
  /// A segment whose chunks come or have come. Numbered as they are read.
  struct Segment {
    std::uint64_t no = 0, lap = 0, first_frame = 0, end_frame = 0;
    Wanted wanted;
  };
  struct Chunk {
    std::uint64_t segment_no = 0;
    std::uint32_t segment_index = 0;
    std::uint64_t first_frame = 0;
    std::uint32_t frame_count = 0;
    container::ChunkRecord record;
  };
  /// A decoder of a track and what waits for it. A track may have several, which take its segments
  /// in turn: each segment begins with a decoder that knows nothing of the one before.
  struct Lane {
    std::size_t track = 0;  ///< whose
    std::size_t turn = 0;   ///< takes the segments whose number leaves this over
    std::vector<Chunk> inbox;
    std::optional<decoders::TrackDecoder> incoming;  ///< for the strand to take over
    std::size_t held_bytes = 0;                      ///< storage of the chunk in the decoder

    // The strand's alone.
    std::optional<decoders::TrackDecoder> decoder;
    Chunk chunk;
    std::uint64_t epoch = 0;
    std::uint64_t cursor = 0;      ///< seq of the next frame
    std::uint64_t segment_no = 0;  ///< whose chunk is in the decoder; 0: none
    decoders::VideoFrame last;     ///< of the frame before
    std::uint64_t last_seq = 0;
    std::uint64_t pictures = 0;  ///< of the decoder's that have been counted

    std::unique_ptr<WorkerPool::Strand> strand;
  };
  struct Track {
    PrefetchStats::Track about;
    decoders::VideoFormat format;
    decoders::VideoDecoderOptions decoding;  ///< what its decoders are opened with
    bool pose = false;
    bool enabled = false;  ///< the layer is wanted from the next segment on
    std::size_t picture_bytes = 0;
    bool noted = false;  ///< the decoder's note has been passed on
    std::vector<std::unique_ptr<Lane>> lanes;

    // Of the poses, which have one lane; its strand's alone.
    std::optional<decoders::PoseTrack> poses;
    decoders::Pose scratch;
  };

  explicit State(ClipDemuxer d) : demuxer(std::move(d)), timeline(demuxer.timeline()) {}
  ~State();
  [[nodiscard]] static Clock::time_point after(double timeout_s);

  // prefetch_ring.cpp
  [[nodiscard]] Slot& at(std::uint64_t seq) { return *ring[seq % ring.size()]; }
  [[nodiscard]] Slot* find(std::uint64_t index);
  [[nodiscard]] std::optional<std::uint64_t> following(std::uint64_t index) const;
  void admit();
  void go_on();
  bool admit_one();
  void lay_out(Slot& slot, const Segment* segment);
  void detach(std::uint64_t seq);
  void free_slot(Slot* slot);
  void release_before(std::uint64_t seq);
  void restart(std::uint64_t index, std::optional<std::uint64_t> tick);
  [[nodiscard]] bool is_near(std::uint64_t index) const;
  [[nodiscard]] bool comes_to(std::uint64_t tick) const;
  [[nodiscard]] bool ready(const Slot& slot) const;
  void assemble(Slot& slot);
  Slot* stand_in(Slot& slot);
  void note_peaks();
  void wake();

  // prefetch_tracks.cpp
  Status open_tracks(const PrefetchOptions& options, std::shared_ptr<WorkerPool> workers);
  void share_out_threads(const PrefetchOptions& options);
  [[nodiscard]] Status check_choice(std::span<const std::uint8_t> chosen) const;
  Result<decoders::TrackDecoder> open_decoder(const Track& track) const;
  bool run_strand(Lane& lane);
  bool step(Lane& lane);
  bool begin_step(Lane& lane, std::unique_lock<std::mutex>& lock);
  bool find_work(Lane& lane);
  bool find_chunk(Lane& lane, const Slot& slot);
  void drop_chunks(Lane& lane, std::uint64_t before_no);
  Status load_chunk(Lane& lane);
  Status decode_pose(Track& track, std::uint64_t index);
  Status decode_picture(Lane& lane, std::uint64_t index, decoders::VideoFrame& picture);
  void finish_part(Lane& lane, std::uint64_t seq, const Status& decoded,
                   decoders::VideoFrame& picture);
  void note_damage(const Error& error);

  // prefetch_demux.cpp
  void run();
  void fetch();
  [[nodiscard]] bool may_read() const;
  void go_to_start(std::unique_lock<std::mutex>& lock);
  void begin_lap(std::unique_lock<std::mutex>& lock);
  void read_one(std::unique_lock<std::mutex>& lock);
  void pass_choice_on();
  void take_segment();
  void take_chunk(container::ChunkRecord& chunk);
  void resolve_tick();
  void after_event();
  void fail_with(Error error);
  [[nodiscard]] std::uint64_t lap_end() const;
  [[nodiscard]] std::uint64_t end_after(std::uint64_t frame) const;

  ClipDemuxer demuxer;  ///< the demux thread's; what never changes is everybody's
  std::shared_ptr<WorkerPool> pool;
  std::shared_ptr<decoders::PictureMemory> memory;
  std::size_t ring_limit = 0, packet_limit = 0;
  bool planes = true, impatient = true;

  mutable std::mutex mutex;
  std::condition_variable changed;             ///< for the host
  std::condition_variable work;                ///< for the demux thread
  std::vector<std::unique_ptr<Track>> tracks;  ///< 0: the poses
  Wanted wanted;                               ///< by track
  std::vector<std::uint8_t> wanted_layers;
  bool wanted_changed = false;

  bool closing = false, cancelled = false;
  std::uint64_t epoch = 1;  ///< jumps
  std::uint64_t start = 0;
  std::optional<std::uint64_t> start_tick;  ///< its segment is looked for, and nothing admitted
  std::optional<Error> error;
  bool gone_by = false;  ///< the error is only that what is wanted lies behind

  bool loop = false;
  std::uint64_t loop_begin = 0, loop_end = 0;
  std::uint64_t end_frame = 0;  ///< PrefetchOptions::end_frame
  std::uint64_t every = 1;      ///< set_every()

  std::array<Slot*, 256> ring{};
  std::uint64_t head = 0, tail = 0;  ///< seq
  std::vector<std::unique_ptr<Slot>> slots;
  std::vector<Slot*> free_slots;
  Slot* shown = nullptr;        ///< given for the wanted frame last
  bool shown_detached = false;  ///< it is no longer in the ring
  std::uint64_t wanted_index = 0;
  bool given = false;                       ///< a picture since the start or jump
  bool eager = false;                       ///< playback has moved on from the first picture
  bool underrun = false;                    ///< counted for the wanted frame
  std::optional<std::uint64_t> next_index;  ///< to be admitted; none: the end
  std::uint64_t admit_lap = 0;
  bool admit_first = true;
  std::size_t ring_bytes = 0, pending_bytes = 0;

  std::vector<Segment> segments;  ///< known, not yet behind what has been admitted
  std::uint64_t last_no = 0, closed_no = 0;
  std::uint64_t demux_epoch = 0, demux_lap = 0, lap_start = 0;
  std::uint64_t come_end = 0;  ///< frames of this lap before this one have come
  std::uint64_t near_end = 0;  ///< end of the last segment known, and one such segment more
  std::uint64_t come_ticks = 0, near_end_tick = 0;  ///< where that segment begins; near_end's tick
  bool ended = false;                               ///< of this lap
  bool starving = false;                            ///< a decoder waits for a chunk
  container::Timeline timeline;
  std::vector<container::ChunkRecord> returned;  ///< for the demuxer
  std::size_t packet_bytes = 0, spare_bytes = 0;

  PrefetchStats counts;
  std::uint64_t lost_frames = 0;
  PlaybackLoss demux_loss;
  std::string first_damage;
  std::optional<Error> last_damage;
  Clock::time_point created = Clock::now();
  std::thread thread;
};

}  // namespace relit::player
