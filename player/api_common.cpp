// SPDX-License-Identifier: MIT
#include "player/api_player.hpp"

void relit_player::Log::say(relit_log_level level, const std::string& text) {
  if (function == nullptr) return;
  const std::scoped_lock lock(mutex);
  function(user, level, text.c_str());
}

namespace relit::player::api {

Status check_struct(const char* name, std::size_t size, std::size_t first) {
  if (size >= first && size <= kMostStruct) return {};
  return fail(ErrorCode::kInvalid, std::string(name) + ": struct_size is " + std::to_string(size) +
                                       "; it must be the struct's sizeof, " +
                                       std::to_string(first) + " or more");
}

Status need(const void* pointer, const char* name) {
  if (pointer != nullptr) return {};
  return fail(ErrorCode::kInvalid, std::string(name) + " is NULL");
}

relit_result note(relit_player& player, const Error& error) noexcept {
  try {
    player.error = error.message;
    player.log.say(RELIT_LOG_ERROR, error.message);
  } catch (...) {
    player.error.clear();  // not even the message fits
  }
  return static_cast<relit_result>(error.code);
}

}  // namespace relit::player::api

uint32_t relit_version(void) noexcept {
  return RELIT_VERSION_MAJOR << 16 | RELIT_VERSION_MINOR << 8 | RELIT_VERSION_PATCH;
}

const char* relit_version_text(void) noexcept { return RELIT_VERSION; }

const char* relit_result_name(relit_result result) noexcept {
  switch (result) {
    case RELIT_OK:
      return "RELIT_OK";
    case RELIT_IO:
      return "RELIT_IO";
    case RELIT_TRUNCATED:
      return "RELIT_TRUNCATED";
    case RELIT_CORRUPT:
      return "RELIT_CORRUPT";
    case RELIT_UNSUPPORTED:
      return "RELIT_UNSUPPORTED";
    case RELIT_LIMIT:
      return "RELIT_LIMIT";
    case RELIT_INVALID:
      return "RELIT_INVALID";
    case RELIT_NOT_FOUND:
      return "RELIT_NOT_FOUND";
    case RELIT_OUT_OF_MEMORY:
      return "RELIT_OUT_OF_MEMORY";
    case RELIT_ENVIRONMENT:
      return "RELIT_ENVIRONMENT";
    case RELIT_CANCELLED:
      return "RELIT_CANCELLED";
  }
  return "?";
}

const char* relit_last_error(const relit_player* player) noexcept {
  if (player == nullptr) return "";
  if (!relit::player::api::on_thread(*player))
    return "this thread is not the player's: see relit_adopt() and relit_gl_attach()";
  return player->error.c_str();
}
