// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstring>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>

#include "decoders/image.hpp"
#include "player/interrupt.hpp"
#include "player/player.hpp"
#include "player/relit.h"

/// What stands behind relit.h: the handles, and the border that every call crosses.

struct relit_pool {
  std::shared_ptr<relit::player::WorkerPool> pool;
};

struct relit_player {
  /// Says what the host wants to hear, one call at a time.
  struct Log {
    relit_log function = nullptr;
    void* user = nullptr;
    std::mutex mutex;
    void say(relit_log_level level, const std::string& text);
  };

  std::atomic<std::thread::id> owner;
  std::unique_ptr<relit::player::Player> player;  ///< null: opening failed
  relit::Error failure{relit::ErrorCode::kInvalid, "the player has not been opened"};
  std::string error;  ///< the last one's text
  std::shared_ptr<relit::player::Interrupt> interrupt;
  Log log;
  relit_allocator allocator{};
  std::string plan_text;
  std::optional<relit::decoders::DecodedImage> image;  ///< between size and pixels
  std::uint32_t image_index = 0;
};

namespace relit::player::api {

[[nodiscard]] inline Unexpected invalid(std::string message) {
  return fail(ErrorCode::kInvalid, std::move(message));
}

/// The smallest size that a struct ever had.
template <class T>
inline constexpr std::size_t kFirstSize = sizeof(T);
/// A struct_size beyond this is a variable that nobody set.
inline constexpr std::size_t kMostStruct = 4096;

/// Checks a struct_size. Errors: kInvalid, with the struct's `name`.
[[nodiscard]] Status check_struct(const char* name, std::size_t size, std::size_t first);

/// A host's options as this library knows them. Errors: kInvalid, kUnsupported.
template <class T>
Status read_struct(const char* name, const T* in, T& out) {
  if (in == nullptr) return fail(ErrorCode::kInvalid, std::string(name) + " is NULL");
  RELIT_TRY(check_struct(name, in->struct_size, kFirstSize<T>));
  const auto* bytes = reinterpret_cast<const unsigned char*>(in);
  for (std::size_t i = sizeof(T); i < in->struct_size; ++i) {
    if (bytes[i] != 0)
      return fail(ErrorCode::kUnsupported,
                  std::string(name) + " asks for something that only a later version has");
  }
  std::memcpy(&out, in, std::min(sizeof(T), in->struct_size));
  return {};
}

/// A result as large as the host's struct. Errors: kInvalid.
template <class T>
Status write_struct(const char* name, T value, T* out) {
  if (out == nullptr) return fail(ErrorCode::kInvalid, std::string(name) + " is NULL");
  const std::size_t size = out->struct_size;
  RELIT_TRY(check_struct(name, size, kFirstSize<T>));
  value.struct_size = size;
  std::memset(static_cast<void*>(out), 0, size);
  std::memcpy(static_cast<void*>(out), &value, std::min(sizeof(T), size));
  return {};
}

/// For _default(): `size` is the host's sizeof.
template <class T>
relit_result write_default(T value, T* out, std::size_t size) noexcept {
  if (out == nullptr || size < kFirstSize<T> || size > kMostStruct) return RELIT_INVALID;
  value.struct_size = size;
  std::memset(static_cast<void*>(out), 0, size);
  std::memcpy(static_cast<void*>(out), &value, std::min(sizeof(T), size));
  return RELIT_OK;
}

[[nodiscard]] inline bool on_thread(const relit_player& player) noexcept {
  return player.owner.load(std::memory_order_relaxed) == std::this_thread::get_id();
}

/// Keeps the text, tells the log, and returns the number.
relit_result note(relit_player& player, const Error& error) noexcept;

/// Runs `work`, a function that returns a Status, and lets no exception out.
template <class Work>
Status contained(Work&& work) noexcept {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return Unexpected{Error{ErrorCode::kOutOfMemory, "out of memory"}};
  } catch (const std::length_error&) {
    return Unexpected{Error{ErrorCode::kOutOfMemory, "out of memory"}};
  } catch (...) {
    return Unexpected{Error{ErrorCode::kEnvironment, "the system failed"}};
  }
}

/// A call on a player from its thread: `work` gets it as Player&.
template <class Work>
relit_result call(relit_player* handle, Work&& work) noexcept {
  if (handle == nullptr || !on_thread(*handle)) return RELIT_INVALID;
  if (!handle->player) return note(*handle, handle->failure);
  const Status status = contained([&] { return work(*handle->player); });
  return status ? RELIT_OK : note(*handle, status.error());
}

/// A pointer that must not be null.
[[nodiscard]] Status need(const void* pointer, const char* name);

}  // namespace relit::player::api
