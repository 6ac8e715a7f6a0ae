// SPDX-License-Identifier: MIT
#include "tests/gles/backends.hpp"

#include <cstdlib>
#include <exception>
#include <thread>

#include "tests/test.hpp"

namespace relit::test {
namespace {

constexpr Backend kBackends[] = {
    {"EGL ES 3", gles::OffscreenKind::kEglEs3, gles::Profile::kEs3},
    {"EGL ES 2", gles::OffscreenKind::kEglEs2, gles::Profile::kEs2},
    {"EGL ES 2 mediump", gles::OffscreenKind::kEglEs2, gles::Profile::kEs2Mediump},
    {"OSMesa", gles::OffscreenKind::kOsmesa, gles::Profile::kEs3},
};

thread_local gles::OffscreenContext* current_context = nullptr;

void run(const Backend& backend, const BackendBody& body, const BackendOptions& options) {
  auto context = gles::OffscreenContext::create(backend.kind);
  if (!context && backend.kind == gles::OffscreenKind::kOsmesa) {
    WARN("skipped on OSMesa: " << context.error().message);
    return;
  }
  INFO("backend " << backend.name);
  if (!context) FAIL(context.error().message);
  auto device = gles::Device::create(
      {(*context)->get_proc_address(), backend.profile, options.ignored_extensions});
  if (!device) FAIL(device.error().message);
  current_context = context->get();
  body(**device, backend);
  CHECK((*device)->gl().GetError() == GLenum{GL_NO_ERROR});
}

}  // namespace

gles::OffscreenContext& backend_context() { return *current_context; }

void on_each_backend(const BackendBody& body, const BackendOptions& options) {
  // Where Mesa is told to be ES 2 only, there is no ES 3 context to test.
  const bool no_es3 = options.es2_only || std::getenv("MESA_GLES_VERSION_OVERRIDE") != nullptr;
  for (const Backend& backend : kBackends) {
    if (no_es3 && backend.profile == gles::Profile::kEs3) continue;
    // Assertions may be used on another thread as long as this one waits.
    std::exception_ptr failure;
    std::thread([&] {
      try {
        run(backend, body, options);
      } catch (...) {
        failure = std::current_exception();
      }
    }).join();
    if (failure) std::rethrow_exception(failure);
  }
}

}  // namespace relit::test
