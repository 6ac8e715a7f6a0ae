// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "container/byte_source.hpp"
#include "player/api_player.hpp"
#include "player/source.hpp"

namespace relit::player::api {
namespace {

void* allocate_plainly(void*, std::size_t bytes, std::size_t alignment) {
  return ::operator new(bytes, std::align_val_t(alignment), std::nothrow);
}

// Every allocation of allocate_plainly() has this alignment.
void release_plainly(void*, void* memory, std::size_t) {
  ::operator delete(memory, std::align_val_t(alignof(relit_player)), std::nothrow);
}

constexpr relit_allocator kPlainAllocator{nullptr, &allocate_plainly, &release_plainly};

relit_player* make_player(const relit_allocator& allocator) noexcept {
  void* memory = allocator.allocate(allocator.user, sizeof(relit_player), alignof(relit_player));
  if (memory == nullptr) return nullptr;
  auto* player = new (memory) relit_player;
  player->allocator = allocator;
  player->owner.store(std::this_thread::get_id(), std::memory_order_relaxed);
  return player;
}

relit_open_options default_options() {
  relit_open_options options{};
  options.struct_size = sizeof options;
  options.layers = -1;
  options.interpolate = 1;
  options.quality = -1;
  options.timeout_s = 10;
  return options;
}

Status check_options(const relit_open_options& options) {
  const auto wrong = [](const char* what) {
    return fail(ErrorCode::kInvalid, std::string("relit_open_options: ") + what);
  };
  if (options.layers < -1) return wrong("layers must be -1 or more");
  if (options.threads < 0 || options.threads > 64) return wrong("threads must be 0 to 64");
  if (options.path < RELIT_PATH_AUTO || options.path > RELIT_PATH_FUSED)
    return wrong("path is none of relit_path");
  if (options.model != 0) return wrong("model: the clips of this version have one, number 0");
  if (!(options.target_fps == 0 || (options.target_fps >= 1 && options.target_fps <= 1000)))
    return wrong("target_fps must be 0, or 1 to 1000");
  if (!(options.quality <= 1)) return wrong("quality must be at most 1");
  if (!(options.timeout_s > 0) || !std::isfinite(options.timeout_s))
    return wrong("timeout_s must be positive");
  if (options.allocator != nullptr &&
      (options.allocator->allocate == nullptr || options.allocator->release == nullptr))
    return wrong("the allocator lacks a function");
  return {};
}

PlayerOptions player_options(const relit_open_options& options, relit_player& handle,
                             const std::string& name) {
  PlayerOptions out;
  out.name = name;
  if (options.clip != nullptr) out.clip = options.clip;
  out.layers = options.layers;
  out.threads = options.threads;
  out.interpolate = options.interpolate != 0;
  out.path = static_cast<CompositePath>(options.path);
  if (options.memory_budget_bytes != 0) out.memory_budget_bytes = options.memory_budget_bytes;
  out.drawing.emplace();
  if (options.target_fps > 0) out.governor.target_fps = options.target_fps;
  if (options.quality >= 0) out.governor.quality = options.quality;
  if (options.decoder != nullptr) out.decoder = options.decoder;
  if (options.pool != nullptr) out.pool = options.pool->pool;
  out.interrupt = handle.interrupt;
  if (options.allocator != nullptr)
    out.pictures = std::make_shared<decoders::PictureMemory>(decoders::PictureAllocator{
        options.allocator->user, options.allocator->allocate, options.allocator->release});
  if (handle.log.function != nullptr) {
    out.log = [&handle](LogLevel level, const std::string& text) {
      handle.log.say(static_cast<relit_log_level>(level), text);
    };
  }
  return out;
}

// What relit_open() and its sisters share. `make_source` gets the options, and returns a source.
template <class MakeSource>
relit_result open_player(const relit_open_options* host, const std::string& name,
                         relit_player** out, MakeSource&& make_source) noexcept {
  if (out == nullptr) return RELIT_INVALID;
  *out = nullptr;
  relit_open_options options = default_options();
  const Status read = contained([&]() -> Status {
    if (host != nullptr) RELIT_TRY(read_struct("relit_open_options", host, options));
    return check_options(options);
  });
  const bool own = read && options.allocator != nullptr;
  relit_player* player = make_player(own ? *options.allocator : kPlainAllocator);
  if (player == nullptr) return RELIT_OUT_OF_MEMORY;
  *out = player;
  if (read) player->log.function = options.log, player->log.user = options.log_user;
  const Status opened = !read ? read : contained([&]() -> Status {
    player->interrupt = std::make_shared<Interrupt>();
    RELIT_ASSIGN(std::unique_ptr<container::ByteSource> source, make_source(options, *player));
    RELIT_ASSIGN(player->player,
                 Player::open(std::move(source), player_options(options, *player, name)));
    return {};
  });
  if (opened) return RELIT_OK;
  player->failure = opened.error();
  return note(*player, opened.error());
}

SourceOptions source_options(const relit_open_options& options, relit_player& handle) {
  SourceOptions out;
  for (const char* const* header = options.http_headers; header != nullptr && *header != nullptr;
       ++header)
    out.http_headers.emplace_back(*header);
  out.sparing = options.layers >= 0;
  out.connect_timeout_s = out.read_timeout_s = options.timeout_s;
  out.interrupt = [flag = handle.interrupt, poll = options.interrupt,
                   user = options.interrupt_user] {
    return flag->raised() || (poll != nullptr && poll(user) != 0);
  };
  out.warn = [&handle](const std::string& text) { handle.log.say(RELIT_LOG_WARNING, text); };
  return out;
}

}  // namespace
}  // namespace relit::player::api

using namespace relit;               // NOLINT: definitions of C functions
using namespace relit::player;       // NOLINT
using namespace relit::player::api;  // NOLINT

relit_result relit_open_options_default(relit_open_options* options, size_t struct_size) noexcept {
  return write_default(default_options(), options, struct_size);
}

relit_result relit_pool_options_default(relit_pool_options* options, size_t struct_size) noexcept {
  return write_default(relit_pool_options{}, options, struct_size);
}

relit_result relit_pool_create(const relit_pool_options* options, relit_pool** pool) noexcept {
  if (pool == nullptr) return RELIT_INVALID;
  *pool = nullptr;
  relit_pool_options chosen{};
  const Status status = contained([&]() -> Status {
    if (options != nullptr) RELIT_TRY(read_struct("relit_pool_options", options, chosen));
    if (chosen.threads < 0 || chosen.threads > 64)
      return fail(ErrorCode::kInvalid, "threads must be 0 to 64");
    auto made = std::make_unique<relit_pool>();
    RELIT_ASSIGN(
        made->pool,
        WorkerPool::create(chosen.threads > 0 ? chosen.threads : WorkerPool::default_threads()));
    *pool = made.release();
    return {};
  });
  return status ? RELIT_OK : static_cast<relit_result>(status.error().code);
}

void relit_pool_release(relit_pool* pool) noexcept { delete pool; }

relit_result relit_open(const char* source, const relit_open_options* options,
                        relit_player** player) noexcept {
  return open_player(options, source != nullptr ? source : "", player,
                     [&](const relit_open_options& chosen,
                         relit_player& handle) -> Result<std::unique_ptr<container::ByteSource>> {
                       RELIT_TRY(need(source, "source"));
                       return open_source(source, source_options(chosen, handle));
                     });
}

relit_result relit_open_memory(const void* bytes, size_t size, const relit_open_options* options,
                               relit_player** player) noexcept {
  return open_player(
      options, "memory", player,
      [&](const relit_open_options&,
          relit_player&) -> Result<std::unique_ptr<container::ByteSource>> {
        RELIT_TRY(need(bytes, "bytes"));
        return std::unique_ptr<container::ByteSource>(std::make_unique<container::MemorySource>(
            std::span(static_cast<const std::uint8_t*>(bytes), size)));
      });
}

relit_result relit_open_callbacks(const relit_source* source, const relit_open_options* options,
                                  relit_player** player) noexcept {
  return open_player(options, "source", player,
                     [&](const relit_open_options&,
                         relit_player&) -> Result<std::unique_ptr<container::ByteSource>> {
                       relit_source host{};
                       RELIT_TRY(read_struct("relit_source", source, host));
                       const container::SourceCallbacks callbacks{
                           host.user, host.read, host.seek, host.size, host.expect, host.close};
                       RELIT_ASSIGN(auto opened, container::CallbackSource::open(callbacks));
                       return std::unique_ptr<container::ByteSource>(std::move(opened));
                     });
}

void relit_close(relit_player* player) noexcept {
  if (player == nullptr) return;
  (void)contained([&]() -> Status {
    // What belongs to a context that is not here any more cannot be deleted.
    gles::Device* device = player->player ? player->player->device() : nullptr;
    if (device != nullptr && !device->ready("closing")) player->player->abandon();
    player->player.reset();
    return {};
  });
  const relit_allocator allocator = player->allocator;
  player->~relit_player();
  allocator.release(allocator.user, player, sizeof(relit_player));
}

relit_result relit_cancel(relit_player* player) noexcept {
  if (player == nullptr || !player->player) return RELIT_INVALID;
  player->player->cancel();
  return RELIT_OK;
}

relit_result relit_adopt(relit_player* player) noexcept {
  if (player == nullptr) return RELIT_INVALID;
  if (player->player && player->player->device() != nullptr)
    return on_thread(*player)
               ? note(*player, {ErrorCode::kInvalid, "a GL context is attached; detach it first"})
               : RELIT_INVALID;
  player->owner.store(std::this_thread::get_id(), std::memory_order_relaxed);
  return RELIT_OK;
}
