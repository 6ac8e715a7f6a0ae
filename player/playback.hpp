// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "container/base/result.hpp"
#include "container/records.hpp"
#include "container/timeline.hpp"

/// What is shown when: the clock of a player, without frames, threads or GL. player/PLAYBACK.md has
/// its rules in short.
namespace relit::player {

/// What the clock knows of a clip.
struct PlaybackClip {
  container::Rational tick_rate{50, 1};  ///< ticks per second
  std::uint64_t frame_count = 0;
  std::uint64_t duration_ticks = 0;  ///< as many as frames: evenly spaced, a tick each
  bool loop = false;                 ///< the end meets the beginning
};
[[nodiscard]] PlaybackClip playback_clip(const container::ClipRecord& clip);

/// When a frame is shown: ticks [first_tick, first_tick + ticks).
struct FrameSpan {
  std::uint64_t frame = 0;
  std::uint64_t first_tick = 0;
  std::uint32_t ticks = 1;
};

/// Who knows where the frames of unevenly spaced clips lie; not asked about others. Answers "not
/// known yet" with nothing, and never waits. Clips are numbered as given to Playback.
class FrameTimes {
 public:
  virtual ~FrameTimes() = default;
  [[nodiscard]] virtual std::optional<FrameSpan> at_tick(std::size_t clip,
                                                         std::uint64_t tick) const = 0;
  [[nodiscard]] virtual std::optional<FrameSpan> of_frame(std::size_t clip,
                                                          std::uint64_t frame) const = 0;
};
/// The same of a timeline.
[[nodiscard]] std::optional<FrameSpan> span_at_tick(const container::Timeline& timeline,
                                                    std::uint64_t tick);
[[nodiscard]] std::optional<FrameSpan> span_of_frame(const container::Timeline& timeline,
                                                     std::uint64_t frame);

/// A clip of a sequence.
struct SequenceItem {
  std::size_t clip = 0;
  std::uint32_t repeats = 1;  ///< times that it is played, at least 1
  /// Over which it blends in from the item before, both of them moving: it begins so long before
  /// that one ends. 0: a cut. At most half of the shorter of the two (repeats included) is taken,
  /// so that never more than two clips are seen. The first item's counts where the sequence goes
  /// round.
  double cross_fade_s = 0;
};

enum class LoopMode {
  kAsGiven,  ///< the clip's own flag, or play_sequence()'s argument
  kOff,
  kOn,
};

/// A place between two frames of a clip.
struct FramePosition {
  std::size_t clip = 0;
  std::uint64_t frame = 0;
  /// The one after it, which it is blended into. The same frame where nothing follows; the first
  /// one where a clip goes round whose end meets its beginning.
  std::uint64_t next_frame = 0;
  double fraction = 0;     ///< from frame to next_frame, 0 <= fraction < 1
  std::uint64_t tick = 0;  ///< of the clip: for whoever must find out which frame that is
  /// False: FrameTimes does not know the tick yet. The frame is the last known one of this clip (or
  /// frame 0), to be held.
  bool known = true;
};

/// What a display frame shows.
struct Moment {
  FramePosition primary;                   ///< during a cross-fade: the clip that comes
  std::optional<FramePosition> secondary;  ///< during a cross-fade: the clip that goes
  double secondary_weight = 0;             ///< falls from 1 to 0 linearly
  std::size_t item = 0;                    ///< of the sequence, the primary's
  bool ended = false;  ///< nothing loops, and time has come to the end (backwards: the beginning)
  double time_s = 0;   ///< in the clip or sequence, rounded; what it decides was decided exactly
  /// Until the primary's frame changes if nothing is done; none: it will not.
  std::optional<std::int64_t> next_frame_ns;
};

/// Turns a monotonic time into a place in clips.
///
/// Exactness. Positions are integers in units of 2^-32 ns, divided further by the clip's tick rate,
/// so that a tick is a whole number of them: no rounding builds up, however time is cut into steps
/// and for however long. A speed is rounded to a multiple of 2^-32 once. Of a sequence the unit is
/// divided by the least common multiple of the tick rates' numerators where that is below 2^31;
/// where it is not, the length of every item is rounded up by less than 2^-32 ns.
///
/// Changes take effect from the last at() on, and keep the position: pausing, another speed or loop
/// mode never make it jump. A seek drops the cross-fade that play_clip() began.
///
/// Pure arithmetic: no clock of its own, and at() allocates nothing. One thread at a time.
class Playback {
 public:
  static constexpr double kLargestSpeed = 100;
  static constexpr std::int64_t kMostSteps = 1'000'000;

  /// Stands at the beginning of clip 0, running. `times` may be null where all clips are evenly
  /// spaced; else it outlives this object. Errors: kInvalid for no clips, a clip without frames,
  /// with fewer ticks than frames or a rate that is not positive, or an uneven one without `times`;
  /// kLimit beyond container/base/limits.hpp.
  static Result<Playback> create(std::span<const PlaybackClip> clips, const FrameTimes* times);

  /// Plays one clip from its beginning. With `cross_fade_s` > 0 what is playing blends over into
  /// it, and meanwhile goes on (round, or standing on its last frame). If that is in a cross-fade
  /// itself, the heavier of its two clips is kept. A fade is at most half of a clip that does not
  /// go round, and at most an hour. Errors, changing nothing: kNotFound for a clip that is not
  /// there; kInvalid for a fade that is negative or not finite.
  Status play_clip(std::size_t clip, double cross_fade_s = 0);
  /// Plays clips one after another, with `loop` round and round. `items` is copied. Errors,
  /// changing nothing: those of play_clip; kInvalid for no items or no repeats; kLimit for a length
  /// of more than 136 years.
  Status play_sequence(std::span<const SequenceItem> items, bool loop);

  void set_paused(bool paused) { paused_ = paused; }
  void set_loop(LoopMode mode) { loop_mode_ = mode; }
  /// 1 is real time, 0 stands still, below 0 goes backwards. Errors: kInvalid where it is not
  /// finite or beyond ±kLargestSpeed.
  Status set_speed(double speed);

  /// To a time of the clip or sequence. Before the start: the start. Beyond the end: the end, which
  /// shows the last frame, or the remainder in what loops. A time that names a tick of a clip to
  /// within a millionth of a tick means that tick. Errors: kInvalid where it is not finite.
  Status seek(double time_s);
  /// To a tick, or the start of a frame, of the primary clip; a sequence becomes that one clip.
  /// Beyond the end: the last one. Errors, changing nothing: kNotFound where FrameTimes does not
  /// know the frame yet.
  void seek_tick(std::uint64_t tick);
  Status seek_frame(std::uint64_t frame);
  /// Pauses, and goes to the start of the frame so many further on or back, round the ends of what
  /// loops, else to the first or last. In a sequence it is the primary that steps. Errors, changing
  /// nothing: kNotFound as seek_frame(); kLimit beyond ±kMostSteps in a sequence.
  Status step(std::int64_t frames);

  /// Moves the clock to `now_ns`, a monotonic time of the host's choosing, and says what to show.
  /// The first call starts the clock. A time before the last one counts as no time; more than a
  /// year at once counts as a year.
  Moment at(std::int64_t now_ns);
  /// Lets the time up to `now_ns` pass without playing: before the first picture, or in a stall.
  void skip_to(std::int64_t now_ns) { last_ns_ = now_ns; }
  /// What the last at() would say now, after a change.
  [[nodiscard]] Moment now() { return look(); }

  [[nodiscard]] bool paused() const { return paused_; }
  [[nodiscard]] double speed() const;
  [[nodiscard]] bool loops() const;
  [[nodiscard]] LoopMode loop_mode() const { return loop_mode_; }
  /// Of the clip or the sequence, once through, cross-fades overlapping.
  [[nodiscard]] double duration_s() const;

 private:
  __extension__ typedef __int128 Int;

  /// How far something has come in a clip: `x` in units of which a tick has `tick`.
  struct Place {
    std::size_t clip = 0;
    Int x = 0;
    Int tick = 1;
    bool goes_round = false;  ///< after the last frame comes the first
  };
  /// An item with its place in the program, in the program's units.
  struct Scheduled {
    std::size_t clip = 0;
    std::uint32_t repeats = 1;
    Int start = 0;   ///< from which it is the primary, blending in at first
    Int length = 0;  ///< all repeats
    Int fade = 0;    ///< from the item before
    Int factor = 1;  ///< the program's units times this are those of `tick`
    Int tick = 1;
  };
  /// What is being played: one clip, or a sequence.
  struct Program {
    std::vector<Scheduled> items;
    Int scale = 1;  ///< units in 2^-32 ns
    Int end = 0;    ///< of the last item
    bool loop = false;
    [[nodiscard]] bool is_clip() const {
      return items.size() == 1 && items[0].repeats == 1 && items[0].fade == 0;
    }
  };
  /// A clip that play_clip() is blending over from, in units of its own.
  struct Outgoing {
    Place place;
    Int scale = 1;
    Int faded = 0;  ///< 2^-32 ns
    Int fade = 0;
  };

  Playback() = default;
  [[nodiscard]] Program program_of(std::size_t clip) const;
  void lay_out(std::size_t clip, Program& program) const;
  Result<Program> schedule(std::span<const SequenceItem> items) const;
  Status choose_units(std::span<const SequenceItem> items, Program& program) const;
  void start(Program program);
  [[nodiscard]] Int round() const;
  [[nodiscard]] std::size_t item_at(Int position) const;
  [[nodiscard]] std::size_t item_before(std::size_t item) const;
  [[nodiscard]] Int repeat_at(const Scheduled& item, Int offset) const;
  [[nodiscard]] Place place_in(std::size_t item, Int offset) const;
  [[nodiscard]] bool goes_round(std::size_t item, Int repeat) const;
  void blend_over(double cross_fade_s, const Program& to);
  void advance(Int delta);
  void wrap();
  [[nodiscard]] Moment look();
  [[nodiscard]] FramePosition locate(const Place& place);
  [[nodiscard]] std::optional<std::int64_t> next_change(const FramePosition& shown) const;
  [[nodiscard]] std::optional<FrameSpan> span_at(std::size_t clip, std::uint64_t tick) const;
  [[nodiscard]] std::optional<FrameSpan> span_of(std::size_t clip, std::uint64_t frame) const;
  Status step_in_clip(std::int64_t frames);
  [[nodiscard]] Result<FrameSpan> span_in(std::size_t item, Int offset) const;
  [[nodiscard]] Int position_of(const Scheduled& item, Int repeat, Int tick) const;
  Result<bool> step_on();
  Result<bool> step_back();

  std::vector<PlaybackClip> clips_;
  const FrameTimes* times_ = nullptr;
  Program program_;
  Int position_ = 0;  ///< 0 <= position <= end
  Int rounds_ = 0;    ///< times that the end was passed
  std::optional<Outgoing> outgoing_;
  std::optional<std::int64_t> last_ns_;
  std::int64_t speed_ = std::int64_t{1} << 32;  ///< times 2^32
  bool paused_ = false;
  LoopMode loop_mode_ = LoopMode::kAsGiven;
  std::vector<std::uint64_t> held_;  ///< by clip: the last frame that was known
};

}  // namespace relit::player
