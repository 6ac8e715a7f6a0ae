// SPDX-License-Identifier: MIT
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "player/command.hpp"
#include "player/http_source.hpp"
#include "player/memory_plan.hpp"
#include "player/prefetcher.hpp"
#include "player/relighter.hpp"

namespace relit::player {
namespace {

using Clock = std::chrono::steady_clock;

struct StreamArguments {
  SourceArguments source;
  std::string clip, decoder, sink = "planes";
  LightArguments light;
  int layers = -1;
  int threads = 1;
  std::uint64_t ring_bytes = std::uint64_t{32} << 20;
  std::string memory_budget;
  std::uint64_t loops = 1;
  double seconds = 0;
  bool realtime = false, fill = false, json = false;
};

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// How full the ring was, at even distances over the whole time.
class BufferLevels {
 public:
  struct Level {
    double time_s;
    std::size_t frames, ring_bytes, packet_bytes;
  };
  [[nodiscard]] bool due(double time_s) const { return time_s >= next_s_; }
  void add(double time_s, const PrefetchStats& stats) {
    levels_.push_back({time_s, stats.ring_frames, stats.ring_bytes, stats.packet_bytes});
    next_s_ = time_s + distance_s_;
    if (levels_.size() < kMost) return;
    for (std::size_t i = 0; i < kMost / 2; ++i) levels_[i] = levels_[2 * i];
    levels_.resize(kMost / 2);
    distance_s_ *= 2;
  }
  [[nodiscard]] const std::vector<Level>& levels() const { return levels_; }

 private:
  static constexpr std::size_t kMost = 256;
  std::vector<Level> levels_;
  double distance_s_ = 0.05, next_s_ = 0;
};

/// Where the file can be read twice, how large its segments are; else zeros.
Result<SegmentScale> measure_segments(const SourceArguments& source,
                                      const container::ClipRecord& clip) {
  if (source.name == "-") return SegmentScale{};
  RELIT_ASSIGN(auto bytes, open_source(source, true));
  container::ReaderOptions options;
  options.sparing = true;
  RELIT_ASSIGN(auto reader, container::Reader::open(std::move(bytes), options));
  return largest_segment(reader, clip);
}

/// What fits into --memory-budget; nothing where none was given.
Result<std::optional<MemoryPlan>> plan_within(const StreamArguments& arguments,
                                              const ClipDemuxer& demuxer) {
  if (arguments.memory_budget.empty()) return std::optional<MemoryPlan>();
  auto budget = parse_bytes(arguments.memory_budget);
  if (!budget) return fail(budget.error().code, "--memory-budget " + budget.error().message);
  RELIT_ASSIGN(const SegmentScale segments, measure_segments(arguments.source, demuxer.clip()));
  MemoryWishes wishes;
  wishes.clip = arguments.clip;
  wishes.layers = arguments.layers;
  wishes.threads = arguments.threads;
  wishes.composite = arguments.sink == "composite";
  auto plan = plan_memory(demuxer.contents(), segments, wishes, *budget);
  if (!plan) return demuxer.in_file(plan.error());
  return std::optional(std::move(*plan));
}

/// How long after their time frames were there to be shown, composited if that was asked for.
class Lateness {
 public:
  /// Room that is taken at once, so that it is not while frames are due.
  void expect(std::size_t frames) { ms_.reserve(frames); }
  void add(Clock::duration late) {
    ms_.push_back(std::chrono::duration<float, std::milli>(late).count());
  }
  [[nodiscard]] nlohmann::json json() const {
    if (ms_.empty()) return nullptr;
    std::vector<float> sorted = ms_;
    std::sort(sorted.begin(), sorted.end());
    const auto at = [&](double share) {
      return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
    };
    return {{"median", at(0.5)}, {"99%", at(0.99)}, {"99.9%", at(0.999)}, {"most", at(1)}};
  }

 private:
  std::vector<float> ms_;
};

class Stream {
 public:
  static Result<Stream> open(const StreamArguments& arguments);
  /// Plays until the end, or as long as was asked for.
  Status play();
  void print_json() const;
  void print_summary() const;
  [[nodiscard]] PlaybackLoss loss() const { return clip_->loss(); }

 private:
  explicit Stream(const StreamArguments& arguments) : arguments_(arguments) {
    if (arguments.realtime) lateness_.expect(1 << 16);
  }
  Status show(std::uint64_t index);
  Status fill_ring(std::uint64_t index);
  Status show_in_time(std::uint64_t index, Clock::time_point due, Clock::duration lasts);
  void observe();
  [[nodiscard]] Clock::duration ticks(std::uint64_t count) const;
  [[nodiscard]] bool over() const {
    return arguments_.seconds > 0 && seconds_since(began_) >= arguments_.seconds;
  }

  StreamArguments arguments_;
  Clock::time_point began_ = Clock::now();
  std::optional<MemoryPlan> plan_;
  std::unique_ptr<Prefetcher> clip_;
  std::unique_ptr<Relighter> relighter_;  ///< composites on the CPU, as a player without a GPU
  BufferLevels levels_;
  Lateness lateness_;
  double progress_s_ = 0;
  double open_s_ = 0, first_s_ = 0, play_s_ = 0;
  std::uint64_t frames_ = 0, late_ = 0, dropped_ = 0;
};

Result<Stream> Stream::open(const StreamArguments& arguments) {
  Stream stream(arguments);
  const auto interrupt = std::make_shared<Interrupt>();
  SourceOptions reading;
  reading.http_headers = arguments.source.http_headers;
  reading.sparing = arguments.layers >= 0;
  reading.interrupt = Interrupt::poll(interrupt);
  reading.warn = &warn;
  const std::string& name = arguments.source.name;
  RELIT_ASSIGN(auto bytes, open_source(name, reading));
  RELIT_ASSIGN(auto demuxer, ClipDemuxer::open(std::move(bytes), source_name(name),
                                               {arguments.clip, reading.sparing, interrupt}));
  RELIT_ASSIGN(stream.plan_, plan_within(arguments, demuxer));
  PrefetchOptions options;
  options.ring_bytes = static_cast<std::size_t>(arguments.ring_bytes);
  options.decoder = arguments.decoder;
  options.loop = arguments.loops != 1 && demuxer.seekable();
  options.layers.assign(demuxer.layers().size(), 1);
  for (std::size_t i = 0; i < options.layers.size() && arguments.layers >= 0; ++i) {
    if (i >= static_cast<std::size_t>(arguments.layers)) options.layers[i] = 0;
  }
  int threads = arguments.threads;
  if (stream.plan_) {
    options.ring_bytes = static_cast<std::size_t>(stream.plan_->ring_bytes);
    options.packet_bytes = static_cast<std::size_t>(stream.plan_->packet_bytes);
    options.threads = stream.plan_->decoder_threads;
    options.layers = stream.plan_->layers;
    options.impatient = false;
    threads = stream.plan_->threads;
  }
  std::optional<decoders::Light> light;
  if (arguments.sink == "composite") {
    RELIT_ASSIGN(LoadedLight loaded, load_light(arguments.light, demuxer.model().order));
    light = std::move(loaded.light);
  }
  RELIT_ASSIGN(auto pool, WorkerPool::create(threads));
  RELIT_ASSIGN(stream.clip_, Prefetcher::create(std::move(demuxer), std::move(pool), options));
  if (light) {
    RelightOptions relight;
    relight.meshes = stream.clip_->meshes();
    RELIT_ASSIGN(stream.relighter_,
                 Relighter::create(stream.clip_->model(), stream.clip_->layers(), relight));
    RELIT_TRY(stream.relighter_->set_light(*light, options.layers));
  }
  stream.open_s_ = seconds_since(stream.began_);
  return stream;
}

Clock::duration Stream::ticks(std::uint64_t count) const {
  const auto& rate = clip_->clip().tick_rate;
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(
      static_cast<double>(count) * static_cast<double>(rate.den) / static_cast<double>(rate.num)));
}

Status Stream::show(std::uint64_t index) {
  constexpr double kStep_s = 0.2;
  for (;;) {
    RELIT_ASSIGN(const bool here, clip_->wait(index, kStep_s));
    observe();
    if (here) break;
    if (over()) return {};
  }
  const ClipFrame* frame = clip_->frame(index);
  if (frame == nullptr) return {};
  if (arguments_.fill) RELIT_TRY(fill_ring(index));
  if (relighter_) RELIT_TRY(relighter_->composite({&frame->planes, nullptr, 0, &frame->pose}));
  if (first_s_ == 0) first_s_ = seconds_since(began_);
  ++frames_;
  return {};
}

/// Waits until the ring, the present frame included, is as full as the plan says. Once it has been,
/// it lacks one frame, the last, at most.
Status Stream::fill_ring(std::uint64_t index) {
  constexpr double kPatience_s = 60;
  const std::uint64_t last = std::min(index + plan_->ring_frames, clip_->clip().frame_count) - 1;
  const std::uint64_t behind = index == 0 ? 0 : 1;
  if (last < index + behind + 1) return {};
  RELIT_ASSIGN(const bool full, clip_->wait(last - behind, kPatience_s));
  if (full) return {};
  return fail(ErrorCode::kEnvironment, "--fill: the ring of " + std::to_string(plan_->ring_frames) +
                                           " frames does not fill; it holds " +
                                           std::to_string(clip_->stats().ring_frames));
}

// A frame is late where it is not decoded when its time comes, and where it is not ready to be seen
// before its time is over.
Status Stream::show_in_time(std::uint64_t index, Clock::time_point due, Clock::duration lasts) {
  std::this_thread::sleep_until(due);
  const bool here = clip_->frame(index) != nullptr;
  RELIT_TRY(show(index));
  const Clock::duration after = Clock::now() - due;
  lateness_.add(after);
  if (!here || after > lasts) ++late_;
  return {};
}

Status Stream::play() {
  const std::uint64_t count = clip_->clip().frame_count;
  const bool loops = arguments_.loops != 1 && clip_->seekable();
  const std::uint64_t laps = loops ? arguments_.loops : 1;
  std::optional<Clock::time_point> due;
  for (std::uint64_t lap = 0; laps == 0 || lap < laps; ++lap) {
    for (std::uint64_t k = 0; k < count; ++k) {
      if (over()) break;
      const auto lasts = ticks(clip_->ticks_of(k));
      // Its time is over already: the next one is due.
      if (due && Clock::now() >= *due + lasts) {
        ++dropped_;
        *due += lasts;
        continue;
      }
      clip_->want(k);
      RELIT_TRY(due ? show_in_time(k, *due, lasts) : show(k));
      if (arguments_.realtime && !due) due = Clock::now();
      if (due) *due += lasts;
    }
    if (over()) break;
  }
  play_s_ = seconds_since(began_) - open_s_;
  return {};
}

void Stream::observe() {
  const double now_s = seconds_since(began_);
  if (levels_.due(now_s)) levels_.add(now_s, clip_->stats());
  constexpr double kProgress_s = 0.2;
  if (isatty(STDERR_FILENO) == 0 || now_s < progress_s_ + kProgress_s) return;
  progress_s_ = now_s;
  const PrefetchStats stats = clip_->stats();
  std::fprintf(stderr, "\r%llu frames  %.1f frames/s  ahead %zu frames, %.1f MiB  \033[K",
               static_cast<unsigned long long>(frames_),
               static_cast<double>(frames_) / std::max(now_s - open_s_, 1e-9), stats.ring_frames,
               static_cast<double>(stats.ring_bytes) / (1 << 20));
}

void Stream::print_summary() const {
  const PrefetchStats stats = clip_->stats();
  std::printf("%llu frames in %.2f s: %.1f frames/s; first picture after %.0f ms\n",
              static_cast<unsigned long long>(frames_), play_s_,
              static_cast<double>(frames_) / std::max(play_s_, 1e-9), 1e3 * first_s_);
  std::printf("late %llu, dropped %llu, underruns %llu\n", static_cast<unsigned long long>(late_),
              static_cast<unsigned long long>(dropped_),
              static_cast<unsigned long long>(stats.underruns));
  std::printf("peak memory: pictures %.2f MiB, of which the ring %.2f MiB; packets %.2f MiB\n",
              static_cast<double>(stats.picture_bytes_peak) / (1 << 20),
              static_cast<double>(stats.ring_bytes_peak) / (1 << 20),
              static_cast<double>(stats.packet_bytes_peak) / (1 << 20));
  if (!plan_) return;
  std::printf("memory plan: %.2f MiB of heap, %llu frames ahead, %d %s, %d of %zu layers\n",
              static_cast<double>(plan_->heap_bytes()) / (1 << 20),
              static_cast<unsigned long long>(plan_->ring_frames), plan_->threads,
              plan_->threads == 1 ? "thread" : "threads", plan_->layer_count(),
              plan_->layers.size());
  for (const std::string& sentence : plan_->given_up)
    std::printf("given up: %s\n", sentence.c_str());
}

void Stream::print_json() const {
  const PrefetchStats stats = clip_->stats();
  const PlaybackLoss lost = clip_->loss();
  nlohmann::json out{{"source", arguments_.source.name},
                     {"clip", clip_->clip().name},
                     {"threads", arguments_.threads},
                     {"sink", arguments_.sink},
                     {"realtime", arguments_.realtime},
                     {"frames", frames_},
                     {"seconds", play_s_},
                     {"frames_per_second", static_cast<double>(frames_) / std::max(play_s_, 1e-9)},
                     {"open_s", open_s_},
                     {"first_picture_s", first_s_},
                     {"decode_s", stats.decode_s},
                     {"late", late_},
                     {"dropped", dropped_},
                     {"underruns", stats.underruns}};
  out["lost"] = {{"frames", lost.frames},
                 {"records", lost.records},
                 {"segments", lost.segments},
                 {"first", lost.first}};
  if (plan_) {
    out["plan"] = {{"budget_bytes", plan_->budget_bytes}, {"heap_bytes", plan_->heap_bytes()},
                   {"ring_frames", plan_->ring_frames},   {"threads", plan_->threads},
                   {"layers", plan_->layer_count()},      {"layers_of", plan_->layers.size()},
                   {"given_up", plan_->given_up}};
  }
  out["peak_bytes"] = {{"packets", stats.packet_bytes_peak},
                       {"pictures", stats.picture_bytes_peak},
                       {"ring", stats.ring_bytes_peak}};
  out["tracks"] = nlohmann::json::array();
  for (const PrefetchStats::Track& track : stats.tracks) {
    const char* kind = track.layer < 0 ? "pose" : track.exponents ? "exponents" : "mantissas";
    nlohmann::json entry{{"track", track.track_id},
                         {"kind", kind},
                         {"bytes", track.bytes},
                         {"decoders", track.decoders}};
    if (track.layer >= 0) entry["layer"] = track.layer;
    out["tracks"].push_back(std::move(entry));
  }
  out["buffer"] = nlohmann::json::array();
  for (const BufferLevels::Level& level : levels_.levels()) {
    out["buffer"].push_back({{"time_s", level.time_s},
                             {"frames", level.frames},
                             {"ring_bytes", level.ring_bytes},
                             {"packet_bytes", level.packet_bytes}});
  }
  if (arguments_.realtime) out["lateness_ms"] = lateness_.json();
  out["notes"] = stats.notes;
  std::printf("%s\n", out.dump(2, ' ', false, nlohmann::json::error_handler_t::replace).c_str());
}

int run_stream(const StreamArguments& arguments) {
  if (arguments.sink == "composite" && arguments.light.path.empty()) {
    return report({ErrorCode::kInvalid, "stream --sink composite needs a --light"});
  }
  auto stream = Stream::open(arguments);
  if (!stream) return report(stream.error());
  const Status played = stream->play();
  if (isatty(STDERR_FILENO) != 0) std::fprintf(stderr, "\r\033[K");
  if (!played) return report(played.error());
  if (arguments.json)
    stream->print_json();
  else
    stream->print_summary();
  return report_loss(stream->loss());
}

}  // namespace

void add_stream(CommandLine& line) {
  Options command = line.add("stream", "play a clip without a window, and tell how it went");
  const auto a = std::make_shared<StreamArguments>();
  add_source_options(command, a->source, "path, - or http(s)://; a pipe cannot loop");
  command.add("--clip", a->clip, "by name or number");
  command.add("--layers", a->layers, "only the first so many layers");
  command.add("--threads", a->threads, "that decode").range(1, 64).shows_default();
  Option ring = command.add("--ring", a->ring_bytes, "bytes of frames decoded ahead, such as 8MiB")
                    .size_in_bytes()
                    .shows_default();
  Option budget =
      command
          .add("--memory-budget", a->memory_budget,
               "bytes of the whole process's heap, such as 32MiB: what does not fit is given "
               "up as `relit plan --headless` says")
          .excludes(ring);
  command
      .flag("--fill", a->fill,
            "shows no frame before the budget's ring is full again, as it is when decoding is "
            "faster than playback: for measuring memory")
      .needs(budget);
  command.add("--decoder", a->decoder,
              "try this decoder of libavcodec first, such as h264_v4l2m2m");
  command.add("--loops", a->loops, "how often; 0: until --seconds are over").shows_default();
  command.add("--seconds", a->seconds, "at most so long").not_negative();
  command.flag("--realtime", a->realtime,
               "at the clip's own pace, leaving out frames that come too late; otherwise as "
               "fast as possible");
  command.add("--sink", a->sink, "planes: decode alone; composite: with --light, on the CPU")
      .one_of({"planes", "composite"})
      .shows_default();
  command.add("--light", a->light.path, ".hdr, .exr (equirectangular) or .json");
  add_light_options(command, a->light);
  command.flag("--json", a->json, "the statistics as JSON on standard output");
  command.footer(
      "Examples:\n"
      "  relit stream man.relit --threads 2\n"
      "  relit stream man.relit --memory-budget 32MiB --sink composite --light sky.json\n"
      "  relit stream http://host/man.relit --realtime --loops 0 --seconds 60 --json");
  command.runs([a] {
    if (a->loops == 0 && !(a->seconds > 0)) {
      return report({ErrorCode::kInvalid, "stream --loops 0 needs --seconds"});
    }
    return run_stream(*a);
  });
}

}  // namespace relit::player
