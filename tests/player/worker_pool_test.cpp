// SPDX-License-Identifier: MIT
#include "player/worker_pool.hpp"

#include <atomic>
#include <chrono>
#include <thread>

#include "tests/test.hpp"

using namespace relit;
using namespace relit::player;

namespace {

void wait_for(const std::atomic<int>& value, int least) {
  for (int i = 0; i < 60000 && value < least; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

}  // namespace

TEST_CASE("a strand's steps run one at a time and in order") {
  for (const int threads : {1, 2, 4}) {
    auto pool = WorkerPool::create(threads);
    REQUIRE(pool);
    constexpr int kStrands = 5, kSteps = 2000;
    struct Line {
      std::atomic<bool> inside{false};
      std::atomic<int> overlaps{0}, steps{0};
      std::unique_ptr<WorkerPool::Strand> strand;
    };
    std::vector<Line> lines(kStrands);
    for (Line& line : lines) {
      line.strand = std::make_unique<WorkerPool::Strand>(*pool, [&line] {
        if (line.inside.exchange(true)) ++line.overlaps;
        const bool more = ++line.steps < kSteps;
        line.inside = false;
        return more;
      });
    }
    for (Line& line : lines) line.strand->wake();
    for (Line& line : lines) {
      wait_for(line.steps, kSteps);
      CHECK(line.steps >= kSteps);
      CHECK(line.overlaps == 0);
    }
  }
}

TEST_CASE("a wake is never lost, also while the step runs") {
  auto pool = WorkerPool::create(2);
  REQUIRE(pool);
  std::atomic<int> asked{0}, done{0};
  WorkerPool::Strand strand(*pool, [&] {
    done = asked.load();
    return false;
  });
  for (int i = 1; i <= 5000; ++i) {
    asked = i;
    strand.wake();
  }
  wait_for(done, 5000);
  CHECK(done == 5000);
}

TEST_CASE("strands take turns on one thread") {
  auto pool = WorkerPool::create(1);
  REQUIRE(pool);
  std::atomic<int> other{0};
  WorkerPool::Strand greedy(*pool, [] { return true; });
  WorkerPool::Strand modest(*pool, [&] {
    ++other;
    return false;
  });
  greedy.wake();
  for (int i = 1; i <= 10; ++i) {
    modest.wake();
    wait_for(other, i);
  }
  CHECK(other == 10);
}

TEST_CASE("strands close while they are queued, running or idle") {
  for (int i = 0; i < 200; ++i) {
    auto pool = WorkerPool::create(1 + i % 3);
    REQUIRE(pool);
    std::vector<std::unique_ptr<WorkerPool::Strand>> strands;
    for (int n = 0; n < 8; ++n) {
      strands.push_back(std::make_unique<WorkerPool::Strand>(*pool, [n] { return n % 2 == 0; }));
      strands.back()->wake();
    }
    strands.front()->close();
    strands.front()->wake();
    strands.clear();
  }
}

TEST_CASE("a pool has 1 to 64 threads") {
  for (const int threads : {-1, 0, 65}) {
    const auto pool = WorkerPool::create(threads);
    REQUIRE_FALSE(pool);
    CHECK(pool.error().code == ErrorCode::kInvalid);
  }
  CHECK((*WorkerPool::create(3))->threads() == 3);
}
