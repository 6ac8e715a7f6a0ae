// SPDX-License-Identifier: MIT
#include "player/player.hpp"

#include <thread>

#include "gles/offscreen.hpp"
#include "gles/picture.hpp"
#include "player/look.hpp"
#include "tests/allocations/counter.hpp"
#include "tests/player/prefetch_clip.hpp"

using namespace relit;
using namespace relit::player;
using namespace relit::player::test;

namespace {

constexpr int kSide = 64;
constexpr std::int64_t kDisplay_ns = 16'666'667;

/// Plays the clip at 60 pictures a second of a clock of its own, as fast as frames come, under a
/// light that turns, its picture behind, into the framebuffer that is bound.
class Playing {
 public:
  explicit Playing(Player& player) : player_(player) {
    look_.backdrop.kind = Backdrop::Kind::kHarmonics;
  }
  void lap() {
    const double duration_s = player_.playback().duration_s();
    const auto end_ns = now_ns_ + static_cast<std::int64_t>(1e9 * duration_s);
    while (now_ns_ < end_ns) {
      REQUIRE(player_.turn_light(1e-9 * static_cast<double>(now_ns_)));
      REQUIRE(player_.update(now_ns_));
      if (player_.device() != nullptr)
        REQUIRE(player_.draw(look_at(player_, look_, {}, {kSide, kSide}), look_.backdrop));
      // What has not come is waited for: a late frame is no part of this.
      if (player_.moment().late || !player_.moment().ready) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        if (player_.moment().ready) continue;
      }
      now_ns_ += kDisplay_ns;
    }
  }

 private:
  Player& player_;
  Look look_;
  std::int64_t now_ns_ = 0;
};

/// The fewest allocations of a lap: buffers grow while they change hands.
std::uint64_t least_allocations(Player& player) {
  Playing playing(player);
  for (int lap = 0; lap < 4; ++lap) playing.lap();
  std::uint64_t least = UINT64_MAX;
  for (int tries = 0; least > 0 && tries < 16; ++tries) {
    relit::test::count_allocations();
    playing.lap();
    least = std::min(least, relit::test::counted_allocations());
  }
  return least;
}

std::unique_ptr<Player> open(CompositePath path) {
  PlayerOptions options;
  options.name = "clip";
  options.threads = 2;
  options.path = path;
  options.governor.quality = 1;
  options.sparing = true;  // few buffers change hands, and soon have the size of the largest chunk
  auto player = Player::open(memory_source(read_bytes(shipped_clip())), options);
  REQUIRE(player);
  return std::move(*player);
}

}  // namespace

TEST_CASE("in the steady state a player allocates nothing, without GL") {
  auto player = open(CompositePath::kAuto);
  CHECK(least_allocations(*player) == 0);
  CHECK(player->stats().shown > 0);
}

TEST_CASE("in the steady state a player allocates nothing, drawing by any path") {
  auto context = gles::OffscreenContext::create(gles::OffscreenKind::kEglEs3);
  REQUIRE(context);
  for (const CompositePath path :
       {CompositePath::kCpu, CompositePath::kTexture, CompositePath::kFused}) {
    INFO(composite_path_name(path));
    auto player = open(path);
    auto device = gles::Device::create({(*context)->get_proc_address(), {}, {}});
    REQUIRE(device);
    REQUIRE(player->attach(std::move(*device)));
    {
      auto framebuffer = gles::Framebuffer::create(*player->device(), {kSide, kSide, 1});
      REQUIRE(framebuffer);
      framebuffer->bind();
      CHECK(least_allocations(*player) == 0);
    }
    CHECK(player->stats().shown > 0);
    player->detach();
  }
}
