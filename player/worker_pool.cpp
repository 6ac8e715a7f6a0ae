// SPDX-License-Identifier: MIT
#include "player/worker_pool.hpp"

#include <algorithm>
#include <cassert>
#include <string>
#include <system_error>
#include <utility>

#include "container/base/out_of_memory.hpp"

namespace relit::player {

int WorkerPool::default_threads() {
  return static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1u, 64u));
}

Result<std::shared_ptr<WorkerPool>> WorkerPool::create(int threads) {
  constexpr int kMostThreads = 64;
  if (threads < 1 || threads > kMostThreads) {
    return fail(ErrorCode::kInvalid, "a pool of " + std::to_string(threads) + " threads; 1 to " +
                                         std::to_string(kMostThreads) + " are allowed");
  }
  return catch_out_of_memory("starting threads", [&]() -> Result<std::shared_ptr<WorkerPool>> {
    std::shared_ptr<WorkerPool> pool(new WorkerPool);
    try {
      for (int i = 0; i < threads; ++i) pool->threads_.emplace_back([p = pool.get()] { p->run(); });
    } catch (const std::system_error& error) {
      return fail(ErrorCode::kEnvironment,
                  std::string("the system gives no more threads: ") + error.what());
    }
    return pool;
  });
}

WorkerPool::~WorkerPool() {
  {
    const std::lock_guard lock(mutex_);
    assert(first_ == nullptr);
    stopping_ = true;
  }
  work_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void WorkerPool::enqueue(Strand& strand) {
  strand.state_ = Strand::State::kQueued;
  strand.previous_ = last_;
  strand.next_ = nullptr;
  (last_ != nullptr ? last_->next_ : first_) = &strand;
  last_ = &strand;
}

void WorkerPool::remove(Strand& strand) {
  (strand.previous_ != nullptr ? strand.previous_->next_ : first_) = strand.next_;
  (strand.next_ != nullptr ? strand.next_->previous_ : last_) = strand.previous_;
}

void WorkerPool::run() {
  using State = Strand::State;
  std::unique_lock lock(mutex_);
  for (;;) {
    work_.wait(lock, [&] { return stopping_ || first_ != nullptr; });
    if (first_ == nullptr) return;
    Strand& strand = *first_;
    remove(strand);
    strand.state_ = State::kRunning;
    lock.unlock();
    const bool more = strand.step_();
    lock.lock();
    // After this the strand may be gone.
    if (strand.closing_) {
      strand.state_ = State::kClosed;
      idle_.notify_all();
    } else if (more || strand.state_ == State::kRunningAgain) {
      enqueue(strand);
    } else {
      strand.state_ = State::kIdle;
    }
  }
}

WorkerPool::Strand::Strand(std::shared_ptr<WorkerPool> pool, std::function<bool()> step)
    : pool_(std::move(pool)), step_(std::move(step)) {}

WorkerPool::Strand::~Strand() { close(); }

void WorkerPool::Strand::wake() {
  {
    const std::lock_guard lock(pool_->mutex_);
    if (closing_) return;
    if (state_ == State::kRunning) state_ = State::kRunningAgain;
    if (state_ != State::kIdle) return;
    pool_->enqueue(*this);
  }
  pool_->work_.notify_one();
}

void WorkerPool::Strand::close() {
  std::unique_lock lock(pool_->mutex_);
  closing_ = true;
  if (state_ == State::kQueued) pool_->remove(*this);
  const bool running = state_ == State::kRunning || state_ == State::kRunningAgain;
  if (!running) state_ = State::kClosed;
  pool_->idle_.wait(lock, [&] { return state_ == State::kClosed; });
}

}  // namespace relit::player
