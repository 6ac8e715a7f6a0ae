// SPDX-License-Identifier: MIT
// soak_bench FILE MINUTES [SEED] [egl|osmesa|none]: two players do, for so long, what hosts do, at
// random and with a fixed seed: open in every way and close, seek, step, change light, clip,
// quality, layers, path, speed and size, attach and lose contexts. Between, what they show is
// compared with what a player shows that was just opened; and with everything closed it is looked
// at what is still held. FILE has two clips or more. Ends with a verdict; exit status 1: failed.
#include <array>
#include <chrono>
#include <cmath>
#include <cstdarg>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <tuple>

#include "gles/device.hpp"
#include "gles/offscreen.hpp"
#include "gles/picture.hpp"
#include "player/relit.h"
#include "tests/bench/soak_figures.hpp"

namespace relit::soak {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kSide = 192;
constexpr int kLights = 3;
constexpr double kWait_s = 120;  // that cannot be passed without something being wrong

// What memory may differ by at rest between two quarters of the time. Heap: FFmpeg, zstd and the
// driver keep caches of bounded size, and a leak of 100 bytes a picture or of 1 kB an opening would
// pass it within ten minutes. Resident: the heap's pages are given back in part only.
constexpr double kHeapTolerance = 256 * 1024.0;
constexpr double kResidentTolerance = 8 * 1024 * 1024.0;

int failures = 0;

[[gnu::format(printf, 1, 2)]] void failed(const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  std::printf("FAILED: ");
  std::vprintf(format, arguments);
  std::printf("\n");
  va_end(arguments);
  std::fflush(stdout);
  if (++failures >= 20) std::exit(1);
}

class Chance {
 public:
  explicit Chance(std::uint64_t seed) : engine_(seed) {}
  /// 0 to n - 1. The standard's distributions differ between libraries.
  int below(int n) { return static_cast<int>(engine_() % static_cast<std::uint64_t>(n)); }
  bool one_in(int n) { return below(n) == 0; }
  double unit() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double between(double low, double high) { return low + (high - low) * unit(); }

 private:
  std::mt19937_64 engine_;
};

std::array<float, 27> light_of(int number) {
  Chance chance(static_cast<std::uint64_t>(number));
  std::array<float, 27> light{};
  for (std::size_t i = 0; i < light.size(); ++i)
    light[i] = static_cast<float>(i < 3 ? chance.between(2, 4) : chance.between(-0.8, 0.8));
  return light;
}

/// Where pictures are drawn; lost now and then.
class Context {
 public:
  explicit Context(std::optional<gles::OffscreenKind> kind) : kind_(kind) {}
  void make() {
    if (!kind_) return;
    auto made = gles::OffscreenContext::create(*kind_);
    if (!made) {
      failed("no context: %s", made.error().message.c_str());
      std::exit(2);
    }
    context_ = std::move(*made);
    find_ = context_->get_proc_address();
    device_ = std::move(*gles::Device::create({find_, std::nullopt, {}}));
    framebuffer_.emplace(std::move(*gles::Framebuffer::create(*device_, {kSide, kSide, 1})));
  }
  void drop() {
    framebuffer_.reset();
    device_.reset();
    context_.reset();
  }
  [[nodiscard]] bool there() const { return context_ != nullptr; }
  void bind() { framebuffer_->bind(); }
  [[nodiscard]] relit_gl_options options() {
    relit_gl_options options;
    relit_gl_options_default(&options, sizeof options);
    options.user = this;
    options.get_proc_address = [](void* user, const char* name) {
      return static_cast<Context*>(user)->find_(name);
    };
    return options;
  }

 private:
  std::optional<gles::OffscreenKind> kind_;
  std::unique_ptr<gles::OffscreenContext> context_;
  gles::GetProcAddress find_;
  std::unique_ptr<gles::Device> device_;
  std::optional<gles::Framebuffer> framebuffer_;
};

/// What a frame of a clip shows under a light.
struct Picture {
  std::vector<float> light_map, vertices;
  float peak = 0;
};

bool ok(relit_player* player, relit_result result, const char* what) {
  if (result != RELIT_OK)
    failed("%s: %s: %s", what, relit_result_name(result), relit_last_error(player));
  return result == RELIT_OK;
}

/// Brings a player from whatever state to a frame, and takes what it shows.
Picture picture_at(relit_player* player, std::uint32_t clip, std::uint64_t frame, int light,
                   std::int64_t now_ns) {
  const auto rows = light_of(light);
  Picture picture;
  const bool there = ok(player, relit_set_light_sh(player, rows.data(), 9), "light") &&
                     ok(player, relit_turn_light(player, 0), "turn") &&
                     ok(player, relit_set_quality(player, 1), "quality") &&
                     ok(player, relit_set_layers(player, -1), "layers") &&
                     ok(player, relit_play_clip(player, clip, 0), "clip") &&
                     ok(player, relit_set_paused(player, 1), "pause") &&
                     ok(player, relit_update(player, now_ns, nullptr), "update") &&
                     ok(player, relit_seek_frame(player, frame), "seek") &&
                     ok(player, relit_wait(player, kWait_s, nullptr), "wait");
  if (!there) return picture;
  std::int32_t width = 0, height = 0;
  ok(player, relit_light_map_size(player, &width, &height), "size");
  picture.light_map.resize(std::size_t{3} * static_cast<std::size_t>(width) *
                           static_cast<std::size_t>(height));
  ok(player, relit_light_map_pixels(player, picture.light_map.data(), picture.light_map.size()),
     "light map");
  for (const float value : picture.light_map)
    picture.peak = std::max(picture.peak, std::abs(value));
  relit_mesh_info mesh{};
  mesh.struct_size = sizeof mesh;
  ok(player, relit_mesh(player, 0, &mesh), "mesh");
  picture.vertices.resize(std::size_t{3} * mesh.vertex_count);
  ok(player, relit_posed_vertices(player, 0, picture.vertices.data(), nullptr, mesh.vertex_count),
     "pose");
  return picture;
}

float largest_difference(const std::vector<float>& a, const std::vector<float>& b) {
  if (a.size() != b.size()) return INFINITY;
  float most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const float difference = std::abs(a[i] - b[i]);
    if (!(difference <= most)) most = std::isnan(difference) ? INFINITY : difference;
  }
  return most;
}

class Soak {
 public:
  Soak(std::string path, std::uint64_t seed, std::optional<gles::OffscreenKind> kind)
      : path_(std::move(path)), chance_(seed), context_(kind) {
    std::ifstream file(path_, std::ios::binary);
    bytes_.assign(std::istreambuf_iterator<char>(file), {});
  }
  void run(double minutes);

 private:
  struct Hosted {
    relit_player* player = nullptr;
    bool attached = false;
    std::uint32_t clips = 0;
  };
  void open(Hosted& hosted);
  void close(Hosted& hosted);
  void act(Hosted& hosted);
  void change(Hosted& hosted);
  void change_time(Hosted& hosted);
  void change_contexts(Hosted& hosted);
  void show(Hosted& hosted);
  void check(Hosted& hosted);
  const Picture& expected(std::uint32_t clip, std::uint64_t frame, int light);
  void rest();
  void verdict() const;
  [[nodiscard]] std::int64_t now_ns() const {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now() - began_).count();
  }

  std::string path_;
  std::vector<char> bytes_;
  Chance chance_;
  Context context_;
  Clock::time_point began_ = Clock::now();
  relit_pool* pool_ = nullptr;
  std::array<Hosted, 2> hosted_;
  std::map<std::tuple<std::uint32_t, std::uint64_t, int>, Picture> expected_;
  std::vector<Holding> samples_;
  std::uint64_t actions_ = 0, opened_ = 0, drawn_ = 0, compared_ = 0, contexts_ = 0;
};

// ---- a player comes and goes

/// A file in memory through callbacks.
struct Cursor {
  const std::vector<char>* bytes;
  std::size_t at = 0;
};

relit_source callbacks(const std::vector<char>& bytes) {
  relit_source source{};
  source.struct_size = sizeof source;
  source.user = new Cursor{&bytes};
  source.read = [](void* user, std::uint8_t* out, std::size_t wanted) {
    auto& cursor = *static_cast<Cursor*>(user);
    const std::size_t count = std::min(wanted, cursor.bytes->size() - cursor.at);
    std::copy_n(cursor.bytes->begin() + static_cast<std::ptrdiff_t>(cursor.at), count, out);
    cursor.at += count;
    return static_cast<std::int64_t>(count);
  };
  source.seek = [](void* user, std::uint64_t offset) {
    auto& cursor = *static_cast<Cursor*>(user);
    cursor.at = static_cast<std::size_t>(std::min<std::uint64_t>(offset, cursor.bytes->size()));
    return 0;
  };
  source.size = [](void* user) {
    return static_cast<std::int64_t>(static_cast<Cursor*>(user)->bytes->size());
  };
  source.close = [](void* user) { delete static_cast<Cursor*>(user); };
  return source;
}

void Soak::open(Hosted& hosted) {
  if (pool_ == nullptr) relit_pool_create(nullptr, &pool_);
  relit_open_options options;
  relit_open_options_default(&options, sizeof options);
  if (!chance_.one_in(3)) options.pool = pool_;
  options.threads = 1 + chance_.below(3);
  options.path = chance_.below(2);
  options.interpolate = chance_.below(2);
  if (chance_.one_in(4)) options.memory_budget_bytes = std::uint64_t{256} << 20;
  if (chance_.one_in(4)) options.clip = "1";
  relit_result result = RELIT_OK;
  const int how = chance_.below(3);
  if (how == 0) result = relit_open(path_.c_str(), &options, &hosted.player);
  if (how == 1) result = relit_open_memory(bytes_.data(), bytes_.size(), &options, &hosted.player);
  if (how == 2) {
    const relit_source source = callbacks(bytes_);
    result = relit_open_callbacks(&source, &options, &hosted.player);
  }
  ok(hosted.player, result, "open");
  hosted.clips = relit_clip_count(hosted.player);
  ++opened_;
}

void Soak::close(Hosted& hosted) {
  if (hosted.player != nullptr && chance_.one_in(4)) relit_cancel(hosted.player);
  relit_close(hosted.player);
  hosted = {};
}

// ---- what a host does

void Soak::act(Hosted& hosted) {
  ++actions_;
  if (hosted.player == nullptr) return open(hosted);
  const int what = chance_.below(1000);
  if (what < 10) return close(hosted);
  if (what < 30) return check(hosted);
  if (what < 60) return change_contexts(hosted);
  if (what < 200) return change_time(hosted);
  if (what < 350) return change(hosted);
  show(hosted);
}

void Soak::change(Hosted& hosted) {
  relit_player* const player = hosted.player;
  switch (chance_.below(8)) {
    case 0: {
      auto light = light_of(chance_.below(1000));
      constexpr std::array<float, 5> kScales{0, 1, 1, 1e-30f, 1e30f};
      const float scale = kScales[static_cast<std::size_t>(chance_.below(5))];
      for (float& value : light) value *= scale;
      constexpr std::array<std::uint32_t, 3> kRows{1, 4, 9};
      ok(player, relit_set_light_sh(player, light.data(), kRows[chance_.one_in(2) ? 2 : 1]),
         "light");
      return;
    }
    case 1:
      ok(player, relit_turn_light(player, chance_.between(-10, 10)), "turn");
      return;
    case 2:
      ok(player, relit_set_quality(player, chance_.one_in(3) ? -1 : chance_.unit()), "quality");
      return;
    case 3:
      ok(player, relit_set_layers(player, chance_.below(5) - 1), "layers");
      return;
    case 4:
      ok(player, relit_set_path(player, static_cast<relit_path>(chance_.below(4))), "path");
      return;
    case 5:
      ok(player, relit_set_interpolation(player, chance_.below(2)), "interpolation");
      return;
    case 6:
      ok(player, relit_set_target_fps(player, chance_.between(1, 240)), "target");
      return;
    default: {
      relit_statistics statistics{};
      statistics.struct_size = sizeof statistics;
      ok(player, relit_get_statistics(player, &statistics), "statistics");
      if (statistics.lost_frames + statistics.lost_records + statistics.lost_segments > 0)
        failed("%llu frames of a whole file are lost",
               static_cast<unsigned long long>(statistics.lost_frames));
    }
  }
}

void Soak::change_time(Hosted& hosted) {
  relit_player* const player = hosted.player;
  switch (chance_.below(8)) {
    case 0:
    case 1:
      ok(player, relit_seek(player, chance_.between(-1, 4)), "seek");
      return;
    case 2:
      ok(player, relit_seek_frame(player, static_cast<std::uint64_t>(chance_.below(200))), "frame");
      return;
    case 3: {
      const auto clip = static_cast<std::uint32_t>(chance_.below(static_cast<int>(hosted.clips)));
      ok(player, relit_play_clip(player, clip, chance_.one_in(2) ? 0 : chance_.between(0, 1)),
         "clip");
      return;
    }
    case 4: {
      std::array<relit_sequence_entry, 3> entries{};
      for (auto& entry : entries) {
        entry.clip = static_cast<std::uint32_t>(chance_.below(static_cast<int>(hosted.clips)));
        entry.repeats = 1 + static_cast<std::uint32_t>(chance_.below(2));
        entry.cross_fade_s = chance_.one_in(2) ? 0 : chance_.between(0, 0.5);
      }
      ok(player, relit_play_sequence(player, entries.data(), entries.size(), chance_.below(2)),
         "sequence");
      return;
    }
    case 5:
      ok(player, relit_set_speed(player, chance_.between(-4, 8)), "speed");
      return;
    case 6:
      ok(player, relit_set_paused(player, chance_.below(2)), "pause");
      ok(player, relit_set_loop(player, static_cast<relit_loop>(chance_.below(3))), "loop");
      return;
    default: {
      relit_result stepped = relit_step(player, chance_.below(41) - 20);
      ok(player, stepped, "step");
    }
  }
}

void Soak::change_contexts(Hosted& hosted) {
  if (!context_.there()) return;
  if (chance_.one_in(40)) {
    for (Hosted& each : hosted_) {
      if (each.attached) ok(each.player, relit_gl_abandon(each.player), "abandon");
      each.attached = false;
    }
    context_.drop();
    context_.make();
    ++contexts_;
  } else if (hosted.attached) {
    ok(hosted.player, relit_gl_detach(hosted.player), "detach");
    hosted.attached = false;
  } else {
    const relit_gl_options options = context_.options();
    hosted.attached = ok(hosted.player, relit_gl_attach(hosted.player, &options), "attach");
  }
}

void Soak::show(Hosted& hosted) {
  relit_player* const player = hosted.player;
  if (context_.there()) context_.bind();
  relit_moment moment{};
  moment.struct_size = sizeof moment;
  ok(player, relit_update(player, now_ns(), &moment), "update");
  if (chance_.one_in(10)) {
    const relit_result waited = relit_wait(player, chance_.between(0, 0.02), &moment);
    if (waited != RELIT_CANCELLED) ok(player, waited, "wait");
  }
  if (!hosted.attached) return;
  relit_view view;
  relit_view_default(&view, sizeof view);
  view.view[13] = -0.85f, view.view[14] = -3;
  view.projection[0] = view.projection[5] = 2.5f;
  view.projection[10] = -1.02f, view.projection[11] = -1;
  view.projection[14] = -0.2f, view.projection[15] = 0;
  view.width = 1 + chance_.below(kSide), view.height = 1 + chance_.below(kSide);
  view.background = chance_.below(4);
  view.exposure = chance_.one_in(3) ? 0.3f : 1;
  ok(player, relit_draw(player, &view), "draw");
  ++drawn_;
}

// ---- what is known of it

const Picture& Soak::expected(std::uint32_t clip, std::uint64_t frame, int light) {
  const auto key = std::tuple(clip, frame, light);
  const auto known = expected_.find(key);
  if (known != expected_.end()) return known->second;
  relit_open_options options;
  relit_open_options_default(&options, sizeof options);
  options.path = RELIT_PATH_CPU;
  relit_player* player = nullptr;
  ok(player, relit_open(path_.c_str(), &options, &player), "open");
  const Picture& made = expected_[key] = picture_at(player, clip, frame, light, 0);
  relit_close(player);
  return made;
}

void Soak::check(Hosted& hosted) {
  const auto clip = static_cast<std::uint32_t>(chance_.below(2));
  const auto frame = static_cast<std::uint64_t>(13 * chance_.below(5));
  const int light = chance_.below(kLights);
  const auto path = static_cast<relit_path>(chance_.below(4));
  const Picture& should = expected(clip, frame, light);
  ok(hosted.player, relit_set_path(hosted.player, path), "path");
  const Picture is = picture_at(hosted.player, clip, frame, light, now_ns());
  // The CPU composites to the bit. A GPU's light map has half floats, 11 bits, of sums of them, or
  // the square roots in 8 bits, dithered by one: d(r²) = 2r·2/255 of the peak.
  const float tolerance = !hosted.attached || path == RELIT_PATH_CPU ? 0 : 0.016f * should.peak;
  const float light_differs = largest_difference(is.light_map, should.light_map);
  const float pose_differs = largest_difference(is.vertices, should.vertices);
  const bool uploaded_cpu = hosted.attached && path == RELIT_PATH_CPU;
  if (!(light_differs <= tolerance) || pose_differs != 0)
    failed(
        "after %llu actions, clip %u frame %llu light %d path %d%s: light differs by %g of %g, "
        "vertices by %g",
        static_cast<unsigned long long>(actions_), clip, static_cast<unsigned long long>(frame),
        light, static_cast<int>(path), uploaded_cpu ? " attached" : "",
        static_cast<double>(light_differs), static_cast<double>(should.peak),
        static_cast<double>(pose_differs));
  ++compared_;
  ok(hosted.player, relit_set_paused(hosted.player, 0), "pause");
}

// ---- what is left when all is closed

void Soak::rest() {
  for (Hosted& hosted : hosted_) close(hosted);
  relit_pool_release(std::exchange(pool_, nullptr));
  // A driver keeps what the last pictures used, tens of megabytes, as long as it has a context.
  context_.drop();
  samples_.push_back(holding());
  context_.make();
}

void Soak::run(double minutes) {
  constexpr double kRest_s = 4;
  context_.make();
  for (std::uint32_t clip = 0; clip < 2; ++clip)
    for (std::uint64_t frame = 0; frame < 65; frame += 13)
      for (int light = 0; light < kLights; ++light) expected(clip, frame, light);
  double rested_s = 0;
  began_ = Clock::now();
  for (double now_s = 0; now_s < 60 * minutes; now_s = 1e-9 * static_cast<double>(now_ns())) {
    act(hosted_[static_cast<std::size_t>(chance_.below(2))]);
    if (now_s < rested_s + kRest_s) continue;
    rested_s = now_s;
    rest();
  }
  rest();
  verdict();
}

void Soak::verdict() const {
  const Holding& first = samples_.front();
  const Holding& last = samples_.back();
  const double heap = growth_of(samples_, &Holding::heap_bytes);
  const double resident = growth_of(samples_, &Holding::resident_bytes);
  std::printf(
      "%llu actions: %llu players opened, %llu pictures drawn, %llu compared, %llu contexts "
      "lost, %zu rests\n",
      static_cast<unsigned long long>(actions_), static_cast<unsigned long long>(opened_),
      static_cast<unsigned long long>(drawn_), static_cast<unsigned long long>(compared_),
      static_cast<unsigned long long>(contexts_), samples_.size());
  std::printf(
      "at rest, medians of the second and the last quarter: heap %.0f and %.0f kB (%+.1f), "
      "resident %.1f and %.1f MB (%+.2f)\n",
      1e-3 * median_of(samples_, &Holding::heap_bytes, 0.25, 0.5),
      1e-3 * median_of(samples_, &Holding::heap_bytes, 0.75, 1), 1e-3 * heap,
      1e-6 * median_of(samples_, &Holding::resident_bytes, 0.25, 0.5),
      1e-6 * median_of(samples_, &Holding::resident_bytes, 0.75, 1), 1e-6 * resident);
  std::printf("threads %d at first, %d at last; descriptors %d and %d\n", first.threads,
              last.threads, first.descriptors, last.descriptors);
  if (heap > kHeapTolerance) failed("the heap has grown");
  // A sanitizer's own books grow with what was freed.
  if (!sanitized() && resident > kResidentTolerance) failed("the resident memory has grown");
  if (last.threads > first.threads) failed("threads are left");
  if (last.descriptors > first.descriptors) failed("descriptors are left");
  std::printf("%s\n", failures == 0 ? "PASSED" : "FAILED");
}

}  // namespace
}  // namespace relit::soak

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "soak_bench FILE MINUTES [SEED] [egl|osmesa|none]\n");
    return 2;
  }
  const std::string kind = argc > 4 ? argv[4] : "egl";
  std::optional<relit::gles::OffscreenKind> context;
  if (kind == "egl") context = relit::gles::OffscreenKind::kEglEs3;
  if (kind == "osmesa") context = relit::gles::OffscreenKind::kOsmesa;
  relit::soak::Soak(argv[1], argc > 3 ? std::strtoull(argv[3], nullptr, 0) : 1, context)
      .run(std::atof(argv[2]));
  return relit::soak::failures == 0 ? 0 : 1;
}
