// SPDX-License-Identifier: MIT
#include "gles/offscreen.hpp"

namespace relit::gles {

Result<std::unique_ptr<OffscreenContext>> OffscreenContext::create(OffscreenKind kind) {
  if (kind == OffscreenKind::kOsmesa) return detail::create_osmesa_context();
  return detail::create_egl_context(kind == OffscreenKind::kEglEs3);
}

namespace detail {

Status claim_thread(ThreadUse use) {
  thread_local ThreadUse current = ThreadUse::kNone;
  if (current != ThreadUse::kNone && current != use)
    return fail(ErrorCode::kEnvironment,
                "EGL and OSMesa contexts cannot share a thread; use one thread for each");
  current = use;
  return {};
}

}  // namespace detail
}  // namespace relit::gles
