// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>

#include "container/base/result.hpp"
#include "gles/device.hpp"
#include "gles/offscreen.hpp"

namespace relit::player {

/// Which GL draws, and who composites.
enum class Backend {
  kEgl,            ///< EGL without a display, OpenGL ES 3
  kEglEs2,         ///< the same, restricted to OpenGL ES 2
  kEglEs2Mediump,  ///< the same, with half-float fragment arithmetic
  kOsmesa,         ///< Mesa's software renderer, loaded at run time
  kCpu,            ///< composites on the CPU, draws with whichever GL there is
};

/// "egl", "egl-es2", "egl-es2-mediump", "osmesa" or "cpu". Errors: kInvalid.
[[nodiscard]] Result<Backend> parse_backend(const std::string& name);
[[nodiscard]] const char* backend_name(Backend backend);

/// A context of a backend and what it can do.
struct GlBackend {
  std::unique_ptr<gles::OffscreenContext> context;
  std::unique_ptr<gles::Device> device;  ///< destroyed before the context
  GlBackend() = default;
  GlBackend(GlBackend&&) = default;
  GlBackend& operator=(GlBackend&&) = default;
  ~GlBackend() { device.reset(); }
};
/// Creates it, current on this thread. Errors: kEnvironment, saying what to install.
[[nodiscard]] Result<GlBackend> open_backend(Backend backend);

}  // namespace relit::player
