// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>

#include "container/base/result.hpp"

namespace relit::player {

/// Makes something that takes time on a thread of its own, for somebody who looks in now and then.
/// The thread may be stuck in the system, where nothing stops it (opening a pipe that nobody writes
/// to): it is then left behind, and what it makes in the end it destroys itself. One thread uses an
/// object.
template <class T>
class Background {
 public:
  /// `make` runs on the other thread and must own or share whatever it uses. Errors: kEnvironment
  /// where the system gives no thread.
  static Result<Background> start(std::function<Result<T>()> make) {
    Background background;
    auto shared = background.shared_;
    try {
      std::thread([shared, make = std::move(make)] {
        std::optional<Result<T>> made(make());
        {
          const std::lock_guard lock(shared->mutex);
          shared->done = true;
          if (!shared->abandoned) shared->made.swap(made);
        }
        shared->changed.notify_all();
      }).detach();
    } catch (const std::system_error& error) {
      return fail(ErrorCode::kEnvironment,
                  std::string("the system gives no more threads: ") + error.what());
    }
    return background;
  }

  /// Gives it up, and waits a moment for the thread to end: whoever can should have stopped it.
  ~Background() {
    if (!shared_) return;
    std::unique_lock lock(shared_->mutex);
    shared_->abandoned = true;
    shared_->changed.wait_for(lock, kFarewell, [&] { return shared_->done; });
    // What came in between is destroyed here.
    const std::optional<Result<T>> late = std::exchange(shared_->made, std::nullopt);
    lock.unlock();
  }
  Background(Background&& other) noexcept = default;
  Background& operator=(Background&& other) = delete;

  /// What was made, once; nothing: not yet, or it was taken.
  [[nodiscard]] std::optional<Result<T>> take() {
    const std::lock_guard lock(shared_->mutex);
    return std::exchange(shared_->made, std::nullopt);
  }

 private:
  static constexpr std::chrono::milliseconds kFarewell{500};
  struct Shared {
    std::mutex mutex;
    std::condition_variable changed;
    bool done = false, abandoned = false;
    std::optional<Result<T>> made;
  };
  Background() : shared_(std::make_shared<Shared>()) {}
  std::shared_ptr<Shared> shared_;
};

}  // namespace relit::player
