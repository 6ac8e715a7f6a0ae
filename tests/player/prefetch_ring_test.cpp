// SPDX-License-Identifier: MIT
// Which frames a Prefetcher decodes: a part of the clip, every nth one, over a network.
#include <cstdio>
#include <random>
#include <thread>

#include "player/http_source.hpp"
#include "tests/player/http_server.hpp"
#include "tests/player/prefetch_clip.hpp"

using namespace relit;
using namespace relit::player;
using namespace relit::player::test;

namespace {

// Without being printed where they differ.
bool same(const Bytes& a, const Bytes& b) { return a == b; }

}  // namespace

TEST_CASE("of every nth frame alone, what is shown is exact, and less is decoded") {
  const auto file = read_bytes(shipped_clip());
  const auto expected = all_frames(file);
  for (const std::uint64_t n : {2u, 3u, 7u}) {
    for (const int threads : {1, 4}) {
      auto options = patient();
      options.every = n;
      auto prefetcher = prefetch(memory_source(file), options, threads);
      const std::uint64_t tracks = prefetcher->layers().size();
      for (std::uint64_t k = 0; k < expected.size(); ++k) {
        INFO("every " << n << ", frame " << k);
        REQUIRE(same(fetched(*prefetcher, k), expected[k / n * n]));
      }
      const PrefetchStats stats = prefetcher->stats();
      const std::uint64_t shown = (expected.size() + n - 1) / n, all = expected.size() * tracks;
      CHECK(stats.decoded_frames == shown);
      CHECK(stats.restarts == 0);
      // References are decoded all the same, what nothing refers to is not.
      CHECK(stats.decoded_pictures >= shown * tracks);
      CHECK(stats.decoded_pictures < all);
      std::printf("every %d of the mannequin's frames: %llu of %llu pictures decoded\n",
                  static_cast<int>(n), static_cast<unsigned long long>(stats.decoded_pictures),
                  static_cast<unsigned long long>(all));
      CHECK_FALSE(prefetcher->loss().any());
    }
  }
}

TEST_CASE("the distance of frames can change while they are played") {
  const auto file = read_bytes(shipped_clip());
  const auto expected = all_frames(file);
  auto options = patient();
  options.loop = true;
  auto prefetcher = prefetch(memory_source(file), options);
  std::mt19937 random(3);
  for (int lap = 0; lap < 4; ++lap) {
    for (std::uint64_t k = 0; k < expected.size(); ++k) {
      if (random() % 9 == 0) prefetcher->set_every(1 + random() % 3);
      INFO("lap " << lap << ", frame " << k);
      const Bytes shown = fetched(*prefetcher, k);
      // Its own picture, or one of the two before it.
      bool right = false;
      for (std::uint64_t back = 0; back < 3 && back <= k; ++back)
        right = right || shown == expected[k - back];
      REQUIRE(right);
    }
  }
  CHECK(prefetcher->stats().restarts == 0);
  // A jump goes to the very frame, unless one that stands for it is here.
  prefetcher->set_every(3);
  for (int i = 0; i < 12; ++i) {
    const std::uint64_t k = i % 2 == 0 ? 100 + static_cast<std::uint64_t>(i) : random() % 40;
    INFO("frame " << k);
    const Bytes shown = fetched(*prefetcher, k);
    const bool right = shown == expected[k] || shown == expected[k - k % 3];
    REQUIRE(right);
  }
  CHECK_FALSE(prefetcher->loss().any());
}

TEST_CASE("nothing is fetched beyond the end that was given, until playback goes there") {
  const auto file = read_bytes(shipped_clip());
  const auto expected = all_frames(file);
  auto options = patient();
  options.first_frame = 30, options.end_frame = 33;
  auto prefetcher = prefetch(memory_source(file), options);
  for (std::uint64_t k = 30; k < 33; ++k) REQUIRE(same(fetched(*prefetcher, k), expected[k]));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  PrefetchStats stats = prefetcher->stats();
  CHECK(stats.decoded_frames == 3);
  CHECK(stats.pose_bytes > 0);
  std::uint64_t bytes = 0;
  for (const auto& track : stats.tracks) bytes += track.bytes;
  // One segment of five.
  CHECK(bytes < file.size() / 3);
  REQUIRE(same(fetched(*prefetcher, 80), expected[80]));
  REQUIRE(same(fetched(*prefetcher, 81), expected[81]));
  REQUIRE(same(fetched(*prefetcher, 32), expected[32]));
}

TEST_CASE("over http, frames are prefetched through broken connections, and a stall is left") {
  const auto expected = all_frames(read_bytes(shipped_clip()));
  const HttpServer server(shipped_clip());
  SourceOptions reading;
  reading.retry_s = 5;
  const std::uint64_t half = std::filesystem::file_size(shipped_clip()) / 2;
  for (const std::string& fault : {std::string("ok"), "cut/" + std::to_string(half)}) {
    const auto interrupt = std::make_shared<Interrupt>();
    reading.interrupt = Interrupt::poll(interrupt);
    auto source = HttpSource::open(server.address(fault), reading);
    REQUIRE(source);
    auto prefetcher = prefetch(std::move(*source), patient(), 2, interrupt);
    for (const std::uint64_t k : {0u, 1u, 2u, 110u, 111u, 40u, 41u, 42u, 43u, 119u, 0u}) {
      INFO(fault << ", frame " << k);
      REQUIRE(same(fetched(*prefetcher, k), expected[k]));
    }
    CHECK_FALSE(prefetcher->loss().any());
  }
  const auto interrupt = std::make_shared<Interrupt>();
  reading.interrupt = Interrupt::poll(interrupt);
  auto source = HttpSource::open(server.address("stall/" + std::to_string(half)), reading);
  REQUIRE(source);
  auto prefetcher = prefetch(std::move(*source), patient(), 2, interrupt);
  REQUIRE(same(fetched(*prefetcher, 0), expected[0]));
  prefetcher->want(100);
  const auto came = prefetcher->wait(100, 0.05);
  // Not here, and the one that is shown stays. Closing does not wait for the network.
  CHECK((came && !*came));
  const ClipFrame* shown = prefetcher->shown();
  REQUIRE(shown != nullptr);
  CHECK(same(fingerprint(*shown), expected[0]));
}
