// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <string>

#include "gles/device.hpp"
#include "gles/offscreen.hpp"

/// Runs one test body on every backend: EGL ES 3, EGL ES 2, ES 2 with mediump fragments, OSMesa.
namespace relit::test {

struct Backend {
  const char* name = "";
  gles::OffscreenKind kind = gles::OffscreenKind::kEglEs3;
  gles::Profile profile = gles::Profile::kEs3;
};

struct BackendOptions {
  std::string ignored_extensions;  ///< as DeviceOptions'
  bool es2_only = false;           ///< only the two ES 2 profiles
};

using BackendBody = std::function<void(const gles::Device& device, const Backend& backend)>;

/// The context of the body that runs on this thread: for tests that take it away, or call what a
/// host would.
[[nodiscard]] gles::OffscreenContext& backend_context();

/// Each backend gets a thread and a context of its own, one after the other. EGL must exist; OSMesa
/// is reported as skipped where it does not. After the body no GL error may be pending.
void on_each_backend(const BackendBody& body, const BackendOptions& options = {});

}  // namespace relit::test
