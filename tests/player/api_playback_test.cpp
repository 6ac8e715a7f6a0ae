// SPDX-License-Identifier: MIT
#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "player/remux.hpp"
#include "tests/player/api_fixture.hpp"
#include "tests/player/damage.hpp"

using namespace relit;
using namespace relit::player;
using namespace relit::player::test;

namespace {

constexpr std::int64_t kMs = 1'000'000;

// Two clips of one character: the shipped one, and its second half as another.
std::vector<std::uint8_t> two_clips() {
  const auto open = [](const std::vector<std::uint8_t>& bytes) {
    auto source = RewriteSource::open(std::make_unique<container::MemorySource>(bytes), "clip");
    REQUIRE(source);
    return std::move(*source);
  };
  container::MemorySink half, both;
  RewriteSource whole = open(mannequin());
  RemuxOptions options;
  const std::uint64_t frames = whole.contents().clips.front().frame_count;
  options.frames = RemuxOptions::Frames{frames / 2, frames - 1};
  REQUIRE(remux(whole, half, options));
  std::vector<RewriteSource> sources;
  sources.push_back(open(mannequin()));
  sources.push_back(open(half.bytes()));
  REQUIRE(concat(sources, both));
  return both.bytes();
}

const std::vector<std::uint8_t>& two_clip_file() {
  static const std::vector<std::uint8_t> kFile = two_clips();
  return kFile;
}

std::vector<float> positions(relit_player* player, std::uint32_t mesh = 0) {
  relit_mesh_info info{};
  info.struct_size = sizeof info;
  REQUIRE(relit_mesh(player, mesh, &info) == RELIT_OK);
  std::vector<float> out(std::size_t{3} * info.vertex_count), normals(out.size());
  REQUIRE(relit_posed_vertices(player, mesh, out.data(), normals.data(), info.vertex_count) ==
          RELIT_OK);
  for (std::size_t i = 0; i < normals.size(); i += 3) {
    const double square = double{normals[i]} * normals[i] +
                          double{normals[i + 1]} * normals[i + 1] +
                          double{normals[i + 2]} * normals[i + 2];
    REQUIRE(square == Approx(1).margin(1e-4));
  }
  return out;
}

struct Picture {
  std::vector<float> light, vertices;
};
Picture picture_of(relit_player* player) { return {light_map(player), positions(player)}; }

// |a - b| <= tolerance everywhere.
void check_near(const std::vector<float>& a, const std::vector<float>& b, double tolerance) {
  REQUIRE(a.size() == b.size());
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    most = std::max(most, std::abs(double{a[i]} - double{b[i]}));
  CHECK(most <= tolerance);
}

double largest(const std::vector<float>& values) {
  double most = 0;
  for (const float value : values) most = std::max(most, std::abs(double{value}));
  return most;
}

Picture mean_of(const Picture& a, const Picture& b) {
  Picture mean = a;
  for (std::size_t i = 0; i < mean.light.size(); ++i)
    mean.light[i] = 0.5f * (a.light[i] + b.light[i]);
  for (std::size_t i = 0; i < mean.vertices.size(); ++i)
    mean.vertices[i] = 0.5f * (a.vertices[i] + b.vertices[i]);
  return mean;
}

}  // namespace

TEST_CASE("api: without GL, light maps and vertices come as numbers") {
  const ApiPlayer player(mannequin());
  REQUIRE(player.result == RELIT_OK);
  REQUIRE(relit_set_light_sh(player, kLight, 4) == RELIT_OK);
  waited(player);
  const relit_clip_info clip = clip_of(player);
  const std::vector<float> first = light_map(player);
  CHECK(first.size() == std::size_t{3} * static_cast<std::size_t>(clip.width * clip.height));
  CHECK(largest(first) > 0.1);
  const std::vector<float> stands = positions(player);
  REQUIRE(relit_seek_frame(player, clip.frame_count / 3) == RELIT_OK);
  const relit_moment moment = waited(player);
  CHECK(moment.frame == clip.frame_count / 3);
  CHECK(light_map(player) != first);
  CHECK(positions(player) != stands);
  // The same light, twice as bright: light maps are linear in it.
  const std::vector<float> once = light_map(player);
  float twice[12];
  for (int i = 0; i < 12; ++i) twice[i] = 2 * kLight[i];
  REQUIRE(relit_set_light_sh(player, twice, 4) == RELIT_OK);
  waited(player);
  std::vector<float> half = light_map(player);
  for (float& value : half) value /= 2;
  // The fold is in double, and divided by the largest coefficient before it becomes float: only the
  // last multiplication differs, by half a unit in the last place of the largest value.
  check_near(once, half, 1.2e-7 * largest(once));
}

TEST_CASE("api: light of any size is taken, and of none") {
  const ApiPlayer player(mannequin());
  REQUIRE(player.result == RELIT_OK);
  for (const float level : {1e30f, 1e-30f, 0.0f, -1.0f}) {
    INFO(level);
    float light[12] = {level, level, level};
    REQUIRE(relit_set_light_sh(player, light, 4) == RELIT_OK);
    waited(player);
    for (const float value : light_map(player)) REQUIRE(std::isfinite(value));
    float exposure = -1;
    REQUIRE(relit_auto_exposure(player, &exposure) == RELIT_OK);
    CHECK(std::isfinite(exposure));
    CHECK(exposure >= 0);
  }
}

TEST_CASE("api: seeking beyond the ends shows the last and the first frame") {
  const ApiPlayer player(mannequin());
  REQUIRE(player.result == RELIT_OK);
  const relit_clip_info clip = clip_of(player);
  REQUIRE(relit_set_loop(player, RELIT_LOOP_OFF) == RELIT_OK);
  REQUIRE(relit_seek(player, 1e9) == RELIT_OK);
  relit_moment moment = waited(player);
  CHECK(moment.frame == clip.frame_count - 1);
  CHECK(moment.ended == 1);
  REQUIRE(relit_seek(player, -5) == RELIT_OK);
  moment = waited(player);
  CHECK(moment.frame == 0);
  CHECK(moment.ended == 0);
  REQUIRE(relit_seek_frame(player, ~std::uint64_t{0}) == RELIT_OK);
  CHECK(waited(player).frame == clip.frame_count - 1);
  REQUIRE(relit_set_loop(player, RELIT_LOOP_ON) == RELIT_OK);
  REQUIRE(relit_seek(player, 1.5 * clip.duration_s) == RELIT_OK);
  // Half way through, whatever the frame there is called.
  const auto half = clip.frame_count / 2;
  moment = waited(player);
  CHECK(moment.frame >= half - 1);
  CHECK(moment.frame <= half + 1);
  REQUIRE(relit_seek_frame(player, 0) == RELIT_OK);
  REQUIRE(relit_step(player, -1) == RELIT_OK);
  CHECK(waited(player).frame == clip.frame_count - 1);
  REQUIRE(relit_step(player, 2) == RELIT_OK);
  CHECK(waited(player).frame == 1);
}

TEST_CASE("api: seeking into a damaged segment keeps what was seen, and out of it is right") {
  std::vector<std::uint8_t> file = mannequin();
  const Read read = read_all(file);
  REQUIRE(read.segments.size() >= 3);
  const PlacedSegment& hurt = read.segments[1];
  std::mt19937 random(7);
  // From its first chunk on: layers that are whole would move on.
  damage(file, {hurt.begin + 1024, hurt.end - 100}, random);
  const std::uint64_t inside = hurt.segment.first_frame + 3;
  const std::uint64_t behind = read.segments[2].segment.first_frame;
  const ApiPlayer whole(mannequin()), player(file);
  REQUIRE(player.result == RELIT_OK);
  REQUIRE(relit_set_paused(player, 1) == RELIT_OK);
  waited(player);
  REQUIRE(relit_seek_frame(player, 2) == RELIT_OK);
  waited(player);
  const Picture seen = picture_of(player);
  REQUIRE(relit_seek_frame(player, inside) == RELIT_OK);
  waited(player);
  CHECK(light_map(player) == seen.light);
  CHECK(positions(player) == seen.vertices);
  CHECK(statistics_of(player).lost_frames > 0);
  REQUIRE(relit_seek_frame(player, behind) == RELIT_OK);
  waited(player);
  REQUIRE(relit_seek_frame(whole, behind) == RELIT_OK);
  waited(whole);
  CHECK(light_map(player) == light_map(whole));
}

TEST_CASE("api: frames of unequal length are found by time") {
  CodedFile how;
  how.uneven = true;  // frames of 1, 2, 1 and 2 ticks
  const auto bytes = coded_file(how);
  const ApiPlayer player(bytes);
  REQUIRE(player.result == RELIT_OK);
  const double tick_s = clip_of(player).duration_s / 6;
  for (const auto& [tick, frame] : {std::pair{5.5, 3u}, std::pair{0.5, 0u}, std::pair{2.5, 1u},
                                    std::pair{3.5, 2u}, std::pair{4.5, 3u}}) {
    INFO(tick);
    REQUIRE(relit_seek(player, tick * tick_s) == RELIT_OK);
    CHECK(waited(player).frame == frame);
  }
}

namespace {

/// The uneven clip of a source that gives nothing of its second segment, until it is let go.
struct StalledFile {
  std::vector<std::uint8_t> bytes;
  std::uint64_t from = 0, end = 0;
  std::atomic<std::uint64_t> at{0};
  std::atomic<bool> stall{true};
  std::atomic<bool> gave_up{false};  ///< somebody waited: a test that fails rather than hangs

  StalledFile() {
    CodedFile how;
    how.uneven = true;  // frames of 1, 2, 1 and 2 ticks, 25 a second
    bytes = coded_file(how);
    const PlacedSegment second = read_all(bytes).segments.at(1);
    from = second.begin, end = second.end;
  }
  relit_source callbacks() {
    relit_source source{};
    source.struct_size = sizeof source;
    source.user = this;
    source.read = [](void* user, std::uint8_t* out, std::size_t wanted) -> std::int64_t {
      auto& file = *static_cast<StalledFile*>(user);
      for (int ms = 0; file.stall && file.at >= file.from && file.at < file.end; ++ms) {
        if (ms == 20'000) file.gave_up = true, file.stall = false;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      const bool before = file.stall && file.at < file.from;
      const std::uint64_t left = (before ? file.from : file.bytes.size()) - file.at;
      const auto n = static_cast<std::size_t>(std::min<std::uint64_t>(wanted, left));
      std::copy_n(file.bytes.begin() + static_cast<std::ptrdiff_t>(file.at.load()), n, out);
      file.at += n;
      return static_cast<std::int64_t>(n);
    };
    source.seek = [](void* user, std::uint64_t offset) {
      static_cast<StalledFile*>(user)->at = offset;
      return 0;
    };
    source.size = [](void* user) {
      return static_cast<std::int64_t>(static_cast<StalledFile*>(user)->bytes.size());
    };
    return source;
  }
};

}  // namespace

TEST_CASE("api: until it is known when frames of unequal length are shown, the picture stays") {
  constexpr double kTick_s = 0.04;
  enum class How { kSeek, kSeekAtOnce, kPlay };
  for (const How how : {How::kSeek, How::kSeekAtOnce, How::kPlay}) {
    INFO("case " << static_cast<int>(how));
    StalledFile file;
    const relit_source source = file.callbacks();
    const relit_open_options options = default_options();
    ApiPlayer player;
    REQUIRE(relit_open_callbacks(&source, &options, &player.handle) == RELIT_OK);
    std::vector<float> seen;
    if (how != How::kSeekAtOnce) {
      waited(player);
      seen = light_map(player);
      moment_of(player, 0);
    }
    // The fifth tick is the last frame's, in the segment that does not come.
    if (how != How::kPlay) REQUIRE(relit_seek(player, 4.5 * kTick_s) == RELIT_OK);
    const auto now_ns = static_cast<std::int64_t>(how == How::kPlay ? 4.5e9 * kTick_s : 0);
    for (int i = 0; i < 20; ++i) {
      const relit_moment moment = moment_of(player, now_ns);
      CHECK(moment.ready == (seen.empty() ? 0 : 1));
      CHECK(moment.late == (seen.empty() ? 0 : 1));
      CHECK(moment.frame == 0);
    }
    CHECK(relit_wait(player, 0.01, nullptr) == RELIT_CANCELLED);
    if (!seen.empty()) CHECK(light_map(player) == seen);
    CHECK_FALSE(file.gave_up);
    file.stall = false;
    CHECK(waited(player).frame == 3);
    CHECK(light_map(player) != seen);
  }
}

TEST_CASE("api: the clock moves pictures on, stands when paused, and keeps the speed") {
  const ApiPlayer player(mannequin());
  REQUIRE(player.result == RELIT_OK);
  const relit_clip_info clip = clip_of(player);
  const double frame_s = clip.duration_s / static_cast<double>(clip.frame_count);
  waited(player);
  moment_of(player, 1000 * kMs);
  const auto later = [&](double seconds) {
    moment_of(player, 1000 * kMs + static_cast<std::int64_t>(seconds * 1e9));
    return waited(player);
  };
  relit_moment moment = later(10.4 * frame_s);
  CHECK(moment.frame == 10);
  CHECK(moment.next_s == Approx(0.6 * frame_s).margin(1e-6));
  REQUIRE(relit_set_paused(player, 1) == RELIT_OK);
  CHECK(later(20 * frame_s).frame == 10);
  REQUIRE(relit_set_paused(player, 0) == RELIT_OK);
  REQUIRE(relit_set_speed(player, 2) == RELIT_OK);
  CHECK(later(22 * frame_s).frame == 14);
  // Time that runs backwards is no time.
  CHECK(later(1 * frame_s).frame == 14);
  REQUIRE(relit_set_speed(player, -2) == RELIT_OK);
  CHECK(later(3 * frame_s).frame == 10);
}

TEST_CASE("api: between frames, light and vertices are blended, or not") {
  const ApiPlayer player(mannequin());
  REQUIRE(player.result == RELIT_OK);
  const relit_clip_info clip = clip_of(player);
  const double frame_s = clip.duration_s / static_cast<double>(clip.frame_count);
  REQUIRE(relit_seek_frame(player, 6) == RELIT_OK);
  waited(player);
  const Picture at6 = picture_of(player);
  REQUIRE(relit_seek_frame(player, 7) == RELIT_OK);
  waited(player);
  const Picture at7 = picture_of(player);
  REQUIRE(relit_seek(player, 6.5 * frame_s) == RELIT_OK);
  waited(player);
  const Picture between = picture_of(player);
  const Picture mean = mean_of(at6, at7);
  // A few roundings of single precision, relative to the largest value.
  check_near(between.light, mean.light, 1e-6 * largest(mean.light));
  // A joint that turns by a between two frames puts points at distance r off the straight line
  // between them by r·(1 - cos(a/2)): at 50 frames/s 3 degrees at 1 m are 0.4 mm.
  check_near(between.vertices, mean.vertices, 1e-3);
  CHECK(between.vertices != at6.vertices);
  REQUIRE(relit_set_interpolation(player, 0) == RELIT_OK);
  waited(player);
  CHECK(light_map(player) == at6.light);
  CHECK(positions(player) == at6.vertices);
}

TEST_CASE("api: a cross-fade blends two clips, and ends in the second") {
  const ApiPlayer player(two_clip_file());
  REQUIRE(player.result == RELIT_OK);
  REQUIRE(relit_clip_count(player) == 2);
  REQUIRE(relit_set_interpolation(player, 0) == RELIT_OK);
  waited(player);
  moment_of(player, 0);
  // What is seen alone, at the places where the middle of the fade is.
  const double fade_s = 0.4;
  const auto alone = [&](std::uint32_t clip, double time_s) {
    REQUIRE(relit_play_clip(player, clip, 0) == RELIT_OK);
    REQUIRE(relit_seek(player, time_s) == RELIT_OK);
    waited(player);
    return picture_of(player);
  };
  const Picture going = alone(0, 0.5 * fade_s), coming = alone(1, 0.5 * fade_s);
  CHECK(going.vertices != coming.vertices);
  REQUIRE(relit_play_clip(player, 0, 0) == RELIT_OK);
  waited(player);
  moment_of(player, 0);
  REQUIRE(relit_play_clip(player, 1, fade_s) == RELIT_OK);
  moment_of(player, static_cast<std::int64_t>(0.5 * fade_s * 1e9));
  CHECK(waited(player).clip == 1);
  const Picture middle = picture_of(player);
  const Picture mean = mean_of(going, coming);
  // Weights of a half are exact; what is left are roundings of single precision.
  check_near(middle.light, mean.light, 1e-6 * largest(mean.light));
  check_near(middle.vertices, mean.vertices, 1e-6 * largest(mean.vertices));
  moment_of(player, static_cast<std::int64_t>(fade_s * 1e9) + 1);
  waited(player);
  CHECK(picture_of(player).light == alone(1, fade_s).light);
}

TEST_CASE("api: a sequence plays clip after clip") {
  const ApiPlayer player(two_clip_file());
  REQUIRE(player.result == RELIT_OK);
  const double first_s = clip_of(player, 0).duration_s, second_s = clip_of(player, 1).duration_s;
  const relit_sequence_entry entries[] = {{1, 2, 0}, {0, 1, 0.2}};
  REQUIRE(relit_play_sequence(player, entries, 2, 0) == RELIT_OK);
  waited(player);
  moment_of(player, 0);
  double now_s = 0;
  const auto at = [&](double seconds) {
    while (now_s < seconds) {
      now_s = std::min(seconds, now_s + 0.1);
      moment_of(player, static_cast<std::int64_t>(now_s * 1e9));
      waited(player);
    }
    return moment_of(player, static_cast<std::int64_t>(now_s * 1e9));
  };
  CHECK(at(0.5 * second_s).clip == 1);
  CHECK(at(1.5 * second_s).clip == 1);
  CHECK(at(2 * second_s - 0.1).clip == 0);
  CHECK(at(2 * second_s + 0.5 * first_s).clip == 0);
  CHECK(at(2 * second_s + first_s).ended == 1);
}

TEST_CASE("api: layers that are left out for a while stay within what a budget has planned") {
  relit_open_options options = default_options();
  options.memory_budget_bytes = std::uint64_t{1} << 40;
  const ApiPlayer player(two_clip_file(), options), whole(two_clip_file(), options);
  REQUIRE(player.result == RELIT_OK);
  const auto shown = [](const ApiPlayer& p) {
    REQUIRE(relit_set_light_sh(p, kLight, 4) == RELIT_OK);
    REQUIRE(relit_seek_frame(p, 0) == RELIT_OK);
    waited(p);
    return light_map(p);
  };
  REQUIRE(relit_play_clip(whole, 1, 0) == RELIT_OK);
  const std::vector<float> all = shown(whole);
  for (const int layers : {1, 0}) {
    INFO(layers);
    REQUIRE(relit_set_layers(player, layers) == RELIT_OK);
    REQUIRE(relit_play_clip(player, 1, 0) == RELIT_OK);
    CHECK(shown(player) != all);
    REQUIRE(relit_set_layers(player, -1) == RELIT_OK);
    CHECK(shown(player) == all);
  }
}

TEST_CASE("api: a sequence keeps to the budget, or is refused and nothing changes") {
  // What one clip takes, and two, of one thread each.
  const auto planned = [](std::uint64_t budget, bool sequence) {
    relit_open_options options = default_options();
    options.threads = 1;
    options.memory_budget_bytes = budget;
    const ApiPlayer player(two_clip_file(), options);
    REQUIRE(player.result == RELIT_OK);
    const relit_sequence_entry entries[] = {{0, 1, 0}, {1, 1, 0.2}};
    if (sequence) REQUIRE(relit_play_sequence(player, entries, 2, 0) == RELIT_OK);
    waited(player);
    moment_of(player, 0);
    return statistics_of(player).planned_bytes;
  };
  const std::uint64_t plenty = std::uint64_t{1} << 40;
  const std::uint64_t one = planned(plenty, false), two = planned(plenty, true);
  CHECK(two > one);
  CHECK(planned(two - 1, true) < two);

  relit_open_options options = default_options();
  options.threads = 1;
  // The least budget of one clip: 1 at a time below it is refused.
  std::uint64_t low = 0, high = one;
  while (high - low > 1) {
    options.memory_budget_bytes = low + (high - low) / 2;
    const ApiPlayer player(two_clip_file(), options);
    (player.result == RELIT_OK ? high : low) = options.memory_budget_bytes;
  }
  options.memory_budget_bytes = high;
  const ApiPlayer player(two_clip_file(), options);
  REQUIRE(player.result == RELIT_OK);
  waited(player);
  const auto before = light_map(player);
  const relit_sequence_entry entries[] = {{0, 1, 0}, {1, 1, 0.2}};
  CHECK(relit_play_sequence(player, entries, 2, 0) == RELIT_OUT_OF_MEMORY);
  CHECK(player.error().find_first_of("0123456789") != std::string::npos);
  CHECK(relit_play_clip(player, 1, 0.2) == RELIT_OUT_OF_MEMORY);
  waited(player);
  CHECK(moment_of(player, 0).clip == 0);
  CHECK(light_map(player) == before);
  CHECK(statistics_of(player).planned_bytes <= high);
  // A cut needs no more than a clip.
  CHECK(relit_play_clip(player, 1, 0) == RELIT_OK);
  CHECK(waited(player).clip == 1);
}

TEST_CASE("api: two players share a pool, and it outlives the host's hold") {
  relit_pool* pool = nullptr;
  relit_pool_options pools;
  REQUIRE(relit_pool_options_default(&pools, sizeof pools) == RELIT_OK);
  pools.threads = 2;
  REQUIRE(relit_pool_create(&pools, &pool) == RELIT_OK);
  relit_open_options options = default_options();
  options.pool = pool;
  const ApiPlayer one(mannequin(), options), other(mannequin(), options);
  relit_pool_release(pool);
  REQUIRE(one.result == RELIT_OK);
  REQUIRE(other.result == RELIT_OK);
  REQUIRE(relit_seek_frame(one, 40) == RELIT_OK);
  REQUIRE(relit_seek_frame(other, 41) == RELIT_OK);
  waited(one);
  waited(other);
  const ApiPlayer alone(mannequin());
  REQUIRE(relit_seek_frame(alone, 41) == RELIT_OK);
  waited(alone);
  CHECK(light_map(other) == light_map(alone));
  CHECK(light_map(one) != light_map(other));
}

TEST_CASE("api: statistics add up") {
  const ApiPlayer player(mannequin());
  REQUIRE(player.result == RELIT_OK);
  int changed = 0;
  for (int i = 0; i < 200; ++i) {
    changed += moment_of(player, i * 20 * kMs).changed;
    if (i % 10 == 0) waited(player);
  }
  const relit_statistics s = statistics_of(player);
  CHECK(s.updates == 200);
  CHECK(s.updates == s.shown + s.repeated + s.late + s.waiting);
  CHECK(s.shown <= static_cast<std::uint64_t>(changed));
  CHECK(s.composites >= s.shown);
  CHECK(s.lost_frames == 0);
  CHECK(s.read_bytes > 0);
  CHECK(s.read_bytes < 100 * mannequin().size());
  CHECK(s.ring_bytes <= s.ring_peak_bytes);
  CHECK(s.planes <= s.planes_of);
  CHECK(s.planes > 0);
  CHECK(s.path == RELIT_PATH_CPU);
  CHECK(s.threads >= 1);
}

TEST_CASE("api: planes that a low quality left out come back with a high one") {
  const ApiPlayer player(mannequin());
  REQUIRE(player.result == RELIT_OK);
  REQUIRE(relit_set_paused(player, 1) == RELIT_OK);
  moment_of(player, 0);
  waited(player);
  const std::vector<float> all = light_map(player);
  REQUIRE(relit_set_quality(player, 0) == RELIT_OK);
  // So long that what the quality does not need is fetched no more.
  for (int i = 0; i < 200; ++i) moment_of(player, i * 20 * kMs);
  REQUIRE(relit_seek_frame(player, 1) == RELIT_OK);
  waited(player);
  CHECK(light_map(player) != all);
  REQUIRE(relit_set_quality(player, 1) == RELIT_OK);
  REQUIRE(relit_turn_light(player, 0) == RELIT_OK);
  REQUIRE(relit_seek_frame(player, 0) == RELIT_OK);
  waited(player);
  CHECK(light_map(player) == all);
}

// At 400 000 bytes the shipped clip is in its third of five segments.
TEST_CASE("api: a source that stalls holds up neither updates nor closing") {
  struct Source {
    std::atomic<std::size_t> at{0};
    std::atomic<bool> stall{false}, closed{false};
  } source;
  relit_source callbacks{};
  callbacks.struct_size = sizeof callbacks;
  callbacks.user = &source;
  callbacks.read = [](void* user, std::uint8_t* out, std::size_t bytes) -> std::int64_t {
    auto& s = *static_cast<Source*>(user);
    while (s.stall && s.at > 400'000) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const std::size_t n = std::min({bytes, mannequin().size() - s.at, std::size_t{4096}});
    std::copy_n(mannequin().begin() + static_cast<std::ptrdiff_t>(s.at), n, out);
    s.at += n;
    return static_cast<std::int64_t>(n);
  };
  callbacks.close = [](void* user) { static_cast<Source*>(user)->closed = true; };
  source.stall = true;
  relit_player* player = nullptr;
  REQUIRE(relit_open_callbacks(&callbacks, nullptr, &player) == RELIT_OK);
  waited(player);
  relit_moment moment{};
  int step = 0;
  for (; step < 300; ++step) moment = moment_of(player, step * 20 * kMs);
  // Six seconds have gone by on this clock; what came before the stall may still be in the decoder.
  for (; step < 10'000 && moment.late == 0; ++step) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    moment = moment_of(player, step * 20 * kMs);
  }
  CHECK(moment.late == 1);
  // The clock stands where the source does: nothing was passed over.
  const std::uint64_t frame = moment.frame;
  CHECK(frame < 3 * 25);
  CHECK(relit_play_clip(player, 0, 0) == RELIT_OK);
  CHECK(relit_play_clip(player, 1, 0) == RELIT_NOT_FOUND);
  CHECK(relit_set_speed(player, -1) == RELIT_UNSUPPORTED);
  source.stall = false;
  CHECK(relit_cancel(player) == RELIT_OK);
  CHECK(relit_wait(player, 5, nullptr) == RELIT_CANCELLED);
  relit_close(player);
  CHECK(source.closed);
  relit_source nothing{};
  nothing.struct_size = sizeof nothing;
  CHECK(relit_open_callbacks(&nothing, nullptr, &player) == RELIT_INVALID);
  relit_close(player);
}

TEST_CASE("api: a player can be closed in whatever state") {
  for (int state = 0; state < 9; ++state) {
    INFO(state);
    const ApiPlayer player(two_clip_file());
    REQUIRE(player.result == RELIT_OK);
    if (state == 1) moment_of(player, 0);
    if (state >= 2) waited(player);
    if (state == 3) REQUIRE(relit_seek_frame(player, 50) == RELIT_OK);
    if (state == 4) REQUIRE(relit_play_clip(player, 1, 0.3) == RELIT_OK);
    if (state == 5) {
      REQUIRE(relit_play_clip(player, 1, 0.3) == RELIT_OK);
      moment_of(player, 100 * kMs);
    }
    if (state == 6) REQUIRE(relit_set_layers(player, 1) == RELIT_OK);
    if (state == 7) REQUIRE(relit_cancel(player) == RELIT_OK);
    if (state == 8) {
      REQUIRE(relit_set_loop(player, RELIT_LOOP_OFF) == RELIT_OK);
      REQUIRE(relit_seek(player, 1e9) == RELIT_OK);
      waited(player);
    }
  }
}
