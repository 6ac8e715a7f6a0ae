// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "player/clip_demuxer.hpp"
#include "player/clip_frame.hpp"
#include "player/playback.hpp"
#include "player/worker_pool.hpp"

namespace relit::player {

struct PrefetchOptions {
  /// Pictures and poses that are decoded ahead, by what their buffers really take. At least two
  /// frames are, whatever they take.
  std::size_t ring_bytes = std::size_t{32} << 20;
  /// Coded chunks that wait for their decoder. Where a decoder has nothing to do without the next
  /// segment, that one is read all the same.
  std::size_t packet_bytes = std::size_t{8} << 20;
  /// Frame threads of each mantissa decoder, see decoders::VideoDecoderOptions; each track has one
  /// decoder then. 0: as many decoders for each track as the pool has threads and the ring reaches
  /// over segments (of half a second), which take segments in turn; what threads are left are
  /// shared out among the layers that are wanted.
  int threads = 0;
  std::vector<std::uint8_t> layers;  ///< wanted ones, not 0; empty: all
  bool planes = true;                ///< false: poses only
  /// What its pictures are counted in, and got from; null: one of its own.
  std::shared_ptr<decoders::PictureMemory> memory;
  std::string decoder;            ///< tried first, by libavcodec's name; empty: software
  std::uint64_t first_frame = 0;  ///< where to begin
  /// Nothing is fetched for frames from this one on, unless playback goes there; 0: the clip's end.
  std::uint64_t end_frame = 0;
  std::uint64_t every = 1;  ///< see set_every()
  /// The first picture after the beginning or a jump need not wait for all layers: frame() gives it
  /// with `complete` false as soon as the pose and the most important layer are there.
  bool impatient = true;
  /// After loop_end - 1 comes loop_begin; loop_end 0: the clip's end.
  bool loop = false;
  std::uint64_t loop_begin = 0, loop_end = 0;
};

/// What a Prefetcher holds and has done.
struct PrefetchStats {
  struct Track {
    std::uint32_t track_id = 0;
    int layer = -1;           ///< number of the layer; -1: the poses
    bool exponents = false;   ///< of that layer, else its mantissas
    std::uint64_t bytes = 0;  ///< of chunks that came
    int decoders = 1;         ///< which take the segments in turn
  };
  std::vector<Track> tracks;
  std::uint64_t decoded_frames = 0;    ///< complete ones
  std::uint64_t decoded_pictures = 0;  ///< that the codecs gave for them, of all tracks
  std::uint64_t underruns = 0;         ///< frames that were asked for before they were there
  std::uint64_t restarts = 0;          ///< jumps that threw away what had been fetched
  double first_picture_s = 0;          ///< from create() to the first picture; 0: none yet
  double decode_s = 0;                 ///< that the pool's threads worked for this one
  std::size_t ring_frames = 0;  ///< complete ones ahead of playback, the present one included
  std::size_t ring_bytes = 0, ring_bytes_peak = 0;
  std::size_t packet_bytes = 0, packet_bytes_peak = 0;
  /// Everything in the decoders' buffers: the ring, reference pictures, those being decoded.
  std::size_t picture_bytes = 0, picture_bytes_peak = 0;
  std::size_t pose_bytes = 0;      ///< decoded poses of the segment that is played
  std::vector<std::string> notes;  ///< sentences for the user, such as a decoder that fell back
};

/// Decodes a clip ahead of playback: a ClipDemuxer on a thread of its own, each track's decoder as
/// a strand of a pool, and a ring of frames in the order of playback, bounded in bytes.
///
/// Functions are the host's: one thread at a time calls them, save cancel(). In the steady state
/// nothing is allocated, on any of the threads. Destroying it in any state stops what goes on:
/// within 100 ms where the source can be interrupted (DemuxOptions::interrupt), else as soon as the
/// source's read returns.
class Prefetcher {
 public:
  /// Begins to fetch. Errors: those of the decoders, kInvalid for layers or a loop that do not
  /// fit the clip, kNotFound for a first frame beyond it, kOutOfMemory.
  static Result<std::unique_ptr<Prefetcher>> create(ClipDemuxer demuxer,
                                                    std::shared_ptr<WorkerPool> pool,
                                                    const PrefetchOptions& options);
  ~Prefetcher();
  Prefetcher(const Prefetcher&) = delete;
  Prefetcher& operator=(const Prefetcher&) = delete;

  /// What the demuxer knows; constant.
  [[nodiscard]] const container::FileContents& contents() const;
  [[nodiscard]] const container::ClipRecord& clip() const;
  [[nodiscard]] const container::ModelRecord& model() const;
  [[nodiscard]] const std::vector<container::LayerRecord>& layers() const;
  [[nodiscard]] const std::vector<decoders::Mesh>& meshes() const;
  [[nodiscard]] bool seekable() const;

  /// Playback is at this frame: older ones are given back. A frame a little further on in the order
  /// of playback is come to by going on; any other cancels what is in flight and starts there. Also
  /// clears an error, to try again. Never blocks.
  void want(std::uint64_t frame);

  /// Until want() moves on from the first frame after the beginning or a jump, or asks for another
  /// one, no more than two frames are decoded: the first picture has the machine to itself. This
  /// fills the ring from now on. Never blocks.
  void fetch_ahead();

  /// The frame, if it is decoded; null: not yet. Those from the wanted one on can be asked for.
  /// Where damage hit it, what is shown stays: shown(), or before anything was shown the last good
  /// frame before it; the loss is counted when the wanted frame is asked for. Null for the wanted
  /// frame counts as an underrun, once, unless playback has just begun or jumped. Never blocks.
  /// The pointer holds until want() goes past the frame, and beyond that until frame() gives a
  /// wanted frame again: what is shown stays. An incomplete picture is completed in place by a
  /// later call.
  const ClipFrame* frame(std::uint64_t index);
  /// What frame() last gave for a wanted frame, still valid; null: nothing yet.
  [[nodiscard]] const ClipFrame* shown() const;

  /// Waits until frame(index) is not null. False: not within `timeout_s`. Errors: kCancelled after
  /// cancel(); the source's (kIo, kUnsupported), which stay until want() jumps; kNotFound beyond
  /// the clip, or behind what was read where the source cannot go back; kCorrupt and others where
  /// nothing that could be shown has arrived.
  Result<bool> wait(std::uint64_t index, double timeout_s);
  /// The error that playback has come to, as wait() would return it for the wanted frame.
  [[nodiscard]] Status error() const;
  /// Makes wait() and wait_tick() return, now and from now on. Any thread.
  void cancel();

  /// Playback is at this tick, and span_at_tick() does not know which frame that is: it is looked
  /// for, by going on where reading soon comes to it, else by starting there. What was fetched for
  /// another place goes, and what is shown stays. Nothing happens where the tick is known, or is
  /// being looked for. Never blocks.
  void want_tick(std::uint64_t tick);
  /// Waits until the tick that want_tick() looks for is known. False: not within `timeout_s`.
  /// Errors: kNotFound beyond the clip or what can be read of it; those of wait().
  Result<bool> wait_tick(std::uint64_t tick, double timeout_s);
  /// What is known by now of when frames are shown; nothing: not yet. Never blocks.
  [[nodiscard]] std::optional<FrameSpan> span_at_tick(std::uint64_t tick) const;
  [[nodiscard]] std::optional<FrameSpan> span_of_frame(std::uint64_t index) const;
  /// When a frame that has come begins, and how many ticks it is shown.
  [[nodiscard]] std::uint64_t first_tick(std::uint64_t index) const;
  [[nodiscard]] std::uint32_t ticks_of(std::uint64_t index) const;

  /// Which layers the scene needs, not 0; what is not needed is neither fetched, decoded nor kept.
  /// Holds from the next segment that is read on; `now`: playback starts anew where it is, so that
  /// the present frame has them too, if the source can seek. Errors: kInvalid, those of the
  /// decoders.
  Status set_layers(std::span<const std::uint8_t> wanted, bool now = false);
  /// As in PrefetchOptions; frames that were fetched in another order are fetched again. Errors:
  /// kInvalid.
  Status set_loop(bool loop, std::uint64_t begin = 0, std::uint64_t end = 0);

  /// From here on only frames that `n` divides are fetched, and those that playback starts or jumps
  /// to: each stands for the ones between it and the next, which are decoded only where others
  /// refer to them. Frames that are in the ring stay. Requires n >= 1.
  void set_every(std::uint64_t n);
  /// Other bounds than the PrefetchOptions'. What is there already stays until it has gone by.
  void set_limits(std::size_t ring_bytes, std::size_t packet_bytes);

  [[nodiscard]] PrefetchStats stats() const;
  [[nodiscard]] PlaybackLoss loss() const;

  struct State;  ///< the implementation's

 private:
  explicit Prefetcher(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace relit::player
