// SPDX-License-Identifier: MIT
#include "player/player.hpp"

#include <algorithm>
#include <thread>

#include "gles/offscreen.hpp"
#include "player/look.hpp"
#include "tests/player/coded_file.hpp"
#include "tests/player/prefetch_clip.hpp"

using namespace relit;
using namespace relit::player;
using namespace relit::player::test;

namespace {

// The CPU composites, everything is shown.
PlayerOptions plain() {
  PlayerOptions options;
  options.name = "clip";
  options.threads = 2;
  options.governor.quality = 1;
  return options;
}

std::unique_ptr<Player> open(Bytes file, const PlayerOptions& options) {
  auto player = Player::open(memory_source(std::move(file)), options);
  if (!player) FAIL(player.error().message);
  return std::move(*player);
}

std::vector<float> light_map_of(Player& player) {
  const Player::Size size = player.light_map_size();
  std::vector<float> map(std::size_t{3} * static_cast<std::size_t>(size.width) *
                         static_cast<std::size_t>(size.height));
  REQUIRE(player.read_light_map(map));
  return map;
}

void show(Player& player, std::uint64_t frame) {
  const auto shown = player.show_frame(frame, kPatience_s);
  INFO("frame " << frame << (shown ? "" : ": " + shown.error().message));
  REQUIRE(shown);
  REQUIRE(*shown);
}

std::uint64_t fetched_bytes(const PlayerStats& stats, int layer) {
  std::uint64_t bytes = 0;
  for (const auto& track : stats.prefetch.tracks) bytes += track.layer == layer ? track.bytes : 0;
  return bytes;
}

}  // namespace

TEST_CASE("a player shows frames by number, whatever their order and length") {
  const auto uneven = coded_file({"mpeg4", true, true, true});
  for (const Bytes& file : {read_bytes(shipped_clip()), uneven}) {
    auto all = open(file, plain());
    const std::uint64_t count = all->contents().clips[0].frame_count;
    std::vector<std::vector<float>> maps;
    for (std::uint64_t k = 0; k < count; ++k) {
      show(*all, k);
      CHECK(all->moment().frame == k);
      maps.push_back(light_map_of(*all));
    }
    auto sparing = plain();
    sparing.sparing = true;
    const std::uint64_t last = count - 1;
    sparing.frames = [&](const container::ClipRecord& clip) -> Result<PlayerFrames> {
      CHECK(clip.frame_count == count);
      return PlayerFrames{last, last};
    };
    auto player = open(file, sparing);
    for (const std::uint64_t k : {last, std::uint64_t{1}, std::uint64_t{0}, last / 2, last}) {
      show(*player, k);
      const bool same = light_map_of(*player) == maps[k];
      CHECK(same);
      CHECK(player->ticks_of(k) == all->ticks_of(k));
    }
    CHECK(player->show_frame(count, kPatience_s).error().code == ErrorCode::kNotFound);
  }
}

TEST_CASE("what a player of some frames says no to does not open") {
  auto options = plain();
  options.frames = [](const container::ClipRecord&) -> Result<PlayerFrames> {
    return fail(ErrorCode::kNotFound, "none of these");
  };
  const auto player = Player::open(memory_source(read_bytes(shipped_clip())), options);
  REQUIRE_FALSE(player);
  CHECK(player.error().message == "none of these");
}

TEST_CASE("at the lowest quality every second frame is not decoded") {
  const auto file = read_bytes(shipped_clip());
  std::uint64_t pictures[2]{};
  for (const bool lowest : {false, true}) {
    auto options = plain();
    options.governor.quality = lowest ? 0 : 1;
    options.interpolate = false;
    auto player = open(file, options);
    player->set_loop(LoopMode::kOff);
    const std::uint64_t count = player->contents().clips[0].frame_count;
    for (std::uint64_t k = 0; k < count; ++k) show(*player, k);
    const PlayerStats stats = player->stats();
    pictures[lowest ? 1 : 0] = stats.prefetch.decoded_pictures;
    if (lowest) CHECK(stats.prefetch.decoded_frames <= count / 2 + 1);
    CHECK(stats.prefetch.restarts <= 1);  // the loop that is turned off
  }
  CHECK(pictures[1] < pictures[0]);
}

TEST_CASE("layers whose planes a light does not weigh are neither fetched, decoded nor uploaded") {
  auto context = gles::OffscreenContext::create(gles::OffscreenKind::kEglEs3);
  REQUIRE(context);
  auto options = plain();
  options.path = CompositePath::kTexture;
  auto player = open(read_bytes(shipped_clip()), options);
  auto device = gles::Device::create({(*context)->get_proc_address(), {}, {}});
  REQUIRE(device);
  REQUIRE(player->attach(std::move(*device)));
  const auto layers = player->contents().layers.size();
  REQUIRE(layers == 3);
  // The same from everywhere: coefficient 0 alone, which is in the first layer.
  REQUIRE(player->set_light(*LightField::steady({{{1, 1, 1}}}), nullptr, 0));
  REQUIRE(player->wait(kPatience_s));
  const std::int64_t step_ns = 20'000'000;
  std::int64_t now_ns = 0;
  // Until the light has rested, and what was fetched before is over.
  const auto play = [&](int updates) {
    for (int i = 0; i < updates; ++i) {
      REQUIRE(player->update(now_ns += step_ns));
      REQUIRE(player->wait(kPatience_s));
    }
  };
  play(360);
  const PlayerStats before = player->stats();
  play(240);
  const PlayerStats after = player->stats();
  CHECK(after.planes == 3);
  CHECK(after.planes_of == 27);
  CHECK(fetched_bytes(after, 0) > fetched_bytes(before, 0));
  for (const int layer : {1, 2}) CHECK(fetched_bytes(after, layer) == fetched_bytes(before, layer));
  // A picture a frame, and three planes: 240 frames are shown, and the ring is as long as before or
  // shorter by what it holds at most.
  const std::uint64_t frames = after.prefetch.decoded_frames - before.prefetch.decoded_frames;
  CHECK(after.prefetch.decoded_pictures - before.prefetch.decoded_pictures <= frames + 2);
  CHECK(after.planes_uploaded - before.planes_uploaded <= 3 * 241);
  // Another light brings them back, and nothing of them is missing.
  REQUIRE(player->set_light(*LightField::steady({{{1, 1, 1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}),
                            nullptr, 0));
  play(2);
  const std::vector<float> map = light_map_of(*player);
  auto fresh = open(read_bytes(shipped_clip()), plain());
  REQUIRE(fresh->set_light(*LightField::steady({{{1, 1, 1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}),
                           nullptr, 0));
  show(*fresh, player->moment().frame);
  const std::vector<float> expected = light_map_of(*fresh);
  const float most = *std::max_element(expected.begin(), expected.end());
  float worst = 0;
  for (std::size_t i = 0; i < map.size(); ++i)
    worst = std::max(worst, std::abs(map[i] - expected[i]));
  // Half floats truncate to 10 bits, 2^-10, and what is blended of the next frame is at most as
  // much again: updates fall on frames to within a nanosecond.
  CHECK(worst <= most / 512);
  player->detach();
}

TEST_CASE("only so many planes from the front are composited as are asked for") {
  auto player = open(read_bytes(shipped_clip()), plain());
  REQUIRE(player->set_light(
      *LightField::steady({{{1, 1, 1}, {0.5, 0.4, 0.3}, {0.2, 0.3, 0.4}, {0.3, 0.2, 0.1}}}),
      nullptr, 0));
  show(*player, 5);
  const std::vector<float> all = light_map_of(*player);
  const int needed = player->stats().planes;
  player->set_planes(3);
  show(*player, 5);
  CHECK(player->stats().planes == 3);
  const bool fewer = light_map_of(*player) != all;
  CHECK(fewer);
  player->set_planes(-1);
  show(*player, 5);
  CHECK(player->stats().planes == needed);
  const bool again = light_map_of(*player) == all;
  CHECK(again);
}
