// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include "gles/functions.hpp"

namespace relit::gles {

enum class OffscreenKind {
  kEglEs3,  ///< EGL without a display, OpenGL ES 3
  kEglEs2,  ///< EGL without a display, OpenGL ES 2
  kOsmesa,  ///< Mesa's software renderer in this process, OpenGL 3.3 core
};

/// A context without a window, for the command line and the tests. EGL and OSMesa are looked for at
/// run time, so that neither needs to be there to build or start a program.
///
/// It belongs to one thread at a time. EGL and OSMesa must not share a thread: binding one
/// displaces the other behind its back, so make_current() refuses the second kind on a thread that
/// has used the first. Drivers stay loaded until the process ends.
class OffscreenContext {
 public:
  /// Creates a context and makes it current. Errors: kEnvironment, saying what is missing and what
  /// to install.
  static Result<std::unique_ptr<OffscreenContext>> create(OffscreenKind kind);

  /// The context must not be current on another thread.
  virtual ~OffscreenContext() = default;
  OffscreenContext(const OffscreenContext&) = delete;
  OffscreenContext& operator=(const OffscreenContext&) = delete;

  /// Makes the context current on the calling thread. Errors: kEnvironment.
  virtual Status make_current() = 0;
  /// Detaches it, so that another thread can take it.
  virtual void release_current() = 0;
  /// For DeviceOptions. Valid as long as the process.
  [[nodiscard]] virtual GetProcAddress get_proc_address() const = 0;

 protected:
  OffscreenContext() = default;
};

namespace detail {

Result<std::unique_ptr<OffscreenContext>> create_egl_context(bool es3);
Result<std::unique_ptr<OffscreenContext>> create_osmesa_context();

enum class ThreadUse { kNone, kEgl, kOsmesa };
/// Notes which kind this thread uses. Errors: kEnvironment if it is the other one.
Status claim_thread(ThreadUse use);

}  // namespace detail
}  // namespace relit::gles
