// SPDX-License-Identifier: MIT
#include <dlfcn.h>

#include <array>
#include <bit>
#include <string_view>

#include "gles/capabilities.hpp"
#include "gles/offscreen.hpp"

#define EGL_EGL_PROTOTYPES 0
#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>

namespace relit::gles::detail {
namespace {

constexpr const char* kInstall =
    "; install libegl1, libgles2 and a driver (libegl-mesa0 and libgl1-mesa-dri for Mesa), or use "
    "--backend osmesa";

#define RELIT_EGL_FUNCTIONS(X)                            \
  X(BindAPI, PFNEGLBINDAPIPROC)                           \
  X(ChooseConfig, PFNEGLCHOOSECONFIGPROC)                 \
  X(CreateContext, PFNEGLCREATECONTEXTPROC)               \
  X(CreatePbufferSurface, PFNEGLCREATEPBUFFERSURFACEPROC) \
  X(DestroyContext, PFNEGLDESTROYCONTEXTPROC)             \
  X(DestroySurface, PFNEGLDESTROYSURFACEPROC)             \
  X(GetDisplay, PFNEGLGETDISPLAYPROC)                     \
  X(GetError, PFNEGLGETERRORPROC)                         \
  X(GetProcAddress, PFNEGLGETPROCADDRESSPROC)             \
  X(Initialize, PFNEGLINITIALIZEPROC)                     \
  X(MakeCurrent, PFNEGLMAKECURRENTPROC)                   \
  X(QueryString, PFNEGLQUERYSTRINGPROC)

// The process's EGL: one display, initialised once and never terminated. Terminating it would
// unload the driver, whose allocations leak checkers can then no longer attribute.
struct Egl {
#define RELIT_EGL_MEMBER(name, type) type name = nullptr;
  RELIT_EGL_FUNCTIONS(RELIT_EGL_MEMBER)
#undef RELIT_EGL_MEMBER
  void* library = nullptr;
  void* gles_library = nullptr;
  EGLDisplay display = EGL_NO_DISPLAY;
  bool surfaceless = false;
  std::string problem;

  void load();
  void open_display();
  bool initialize(EGLDisplay candidate);
};

void Egl::load() {
  library = dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  if (library == nullptr) {
    problem = std::string("EGL cannot be loaded (") + dlerror() + ")" + kInstall;
    return;
  }
  auto find = [&]<class F>(F& function, const char* name) {
    function = std::bit_cast<F>(dlsym(library, name));
    if (function == nullptr && problem.empty())
      problem = std::string("libEGL.so.1 has no ") + name + kInstall;
  };
#define RELIT_EGL_FIND(name, type) find(name, "egl" #name);
  RELIT_EGL_FUNCTIONS(RELIT_EGL_FIND)
#undef RELIT_EGL_FIND
  if (!problem.empty()) return;
  // Before EGL 1.5 eglGetProcAddress need not know the core functions; the library does.
  gles_library = dlopen("libGLESv2.so.2", RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  open_display();
  if (display == EGL_NO_DISPLAY && problem.empty())
    problem = std::string("EGL offers neither a surfaceless nor a device nor a default display") +
              kInstall;
}

bool Egl::initialize(EGLDisplay candidate) {
  if (candidate == EGL_NO_DISPLAY || Initialize(candidate, nullptr, nullptr) != EGL_TRUE)
    return false;
  display = candidate;
  const char* extensions = QueryString(display, EGL_EXTENSIONS);
  surfaceless = extensions != nullptr && has_word(extensions, "EGL_KHR_surfaceless_context");
  return true;
}

void Egl::open_display() {
  const char* client = QueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  const std::string_view extensions = client != nullptr ? client : "";
  const auto get_platform_display =
      std::bit_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(GetProcAddress("eglGetPlatformDisplayEXT"));
  if (get_platform_display != nullptr && has_word(extensions, "EGL_EXT_platform_base")) {
    if (has_word(extensions, "EGL_MESA_platform_surfaceless") &&
        initialize(get_platform_display(EGL_PLATFORM_SURFACELESS_MESA,
                                        std::bit_cast<void*>(EGL_DEFAULT_DISPLAY), nullptr)))
      return;
    const auto query_devices =
        std::bit_cast<PFNEGLQUERYDEVICESEXTPROC>(GetProcAddress("eglQueryDevicesEXT"));
    if (query_devices != nullptr && has_word(extensions, "EGL_EXT_platform_device")) {
      std::array<EGLDeviceEXT, 16> devices{};
      EGLint count = 0;
      if (query_devices(static_cast<EGLint>(devices.size()), devices.data(), &count) == EGL_TRUE)
        for (EGLint i = 0; i < count; ++i)
          if (initialize(get_platform_display(EGL_PLATFORM_DEVICE_EXT,
                                              devices[static_cast<std::size_t>(i)], nullptr)))
            return;
    }
  }
  initialize(GetDisplay(EGL_DEFAULT_DISPLAY));
}

const Egl& egl() {
  static const Egl instance = [] {
    Egl loaded;
    loaded.load();
    return loaded;
  }();
  return instance;
}

std::string egl_failure(const char* what) {
  constexpr const char* kDigits = "0123456789ABCDEF";
  const auto code = static_cast<unsigned>(egl().GetError());
  std::string text = std::string(what) + " failed with EGL error 0x";
  for (int shift = 12; shift >= 0; shift -= 4) text += kDigits[(code >> shift) & 15u];
  return text + kInstall;
}

class EglContext final : public OffscreenContext {
 public:
  Status open(bool es3);
  ~EglContext() override;
  Status make_current() override;
  void release_current() override;
  [[nodiscard]] GetProcAddress get_proc_address() const override;

 private:
  EGLContext context_ = EGL_NO_CONTEXT;
  EGLSurface surface_ = EGL_NO_SURFACE;
};

Status EglContext::open(bool es3) {
  const Egl& e = egl();
  if (!e.problem.empty()) return fail(ErrorCode::kEnvironment, e.problem);
  e.BindAPI(EGL_OPENGL_ES_API);
  const EGLint config_attributes[] = {EGL_SURFACE_TYPE,
                                      e.surfaceless ? 0 : EGL_PBUFFER_BIT,
                                      EGL_RENDERABLE_TYPE,
                                      es3 ? EGL_OPENGL_ES3_BIT : EGL_OPENGL_ES2_BIT,
                                      EGL_RED_SIZE,
                                      8,
                                      EGL_GREEN_SIZE,
                                      8,
                                      EGL_BLUE_SIZE,
                                      8,
                                      EGL_ALPHA_SIZE,
                                      8,
                                      EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  if (e.ChooseConfig(e.display, config_attributes, &config, 1, &count) != EGL_TRUE || count < 1)
    return fail(ErrorCode::kEnvironment, std::string("EGL has no configuration for OpenGL ES ") +
                                             (es3 ? "3" : "2") + kInstall);
  const EGLint context_attributes[] = {EGL_CONTEXT_CLIENT_VERSION, es3 ? 3 : 2, EGL_NONE};
  context_ = e.CreateContext(e.display, config, EGL_NO_CONTEXT, context_attributes);
  if (context_ == EGL_NO_CONTEXT)
    return fail(ErrorCode::kEnvironment, egl_failure("eglCreateContext"));
  if (!e.surfaceless) {
    const EGLint surface_attributes[] = {EGL_WIDTH, 1, EGL_HEIGHT, 1, EGL_NONE};
    surface_ = e.CreatePbufferSurface(e.display, config, surface_attributes);
    if (surface_ == EGL_NO_SURFACE)
      return fail(ErrorCode::kEnvironment, egl_failure("eglCreatePbufferSurface"));
  }
  return make_current();
}

EglContext::~EglContext() {
  const Egl& e = egl();
  if (context_ == EGL_NO_CONTEXT) return;
  e.MakeCurrent(e.display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  if (surface_ != EGL_NO_SURFACE) e.DestroySurface(e.display, surface_);
  e.DestroyContext(e.display, context_);
}

Status EglContext::make_current() {
  RELIT_TRY(claim_thread(ThreadUse::kEgl));
  const Egl& e = egl();
  // The API bound is a property of the thread, and this one may be new.
  e.BindAPI(EGL_OPENGL_ES_API);
  if (e.MakeCurrent(e.display, surface_, surface_, context_) != EGL_TRUE)
    return fail(ErrorCode::kEnvironment, egl_failure("eglMakeCurrent"));
  return {};
}

void EglContext::release_current() {
  egl().MakeCurrent(egl().display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
}

GetProcAddress EglContext::get_proc_address() const {
  return [](const char* name) -> void* {
    const Egl& e = egl();
    void* function = std::bit_cast<void*>(e.GetProcAddress(name));
    if (function == nullptr && e.gles_library != nullptr) function = dlsym(e.gles_library, name);
    return function;
  };
}

}  // namespace

Result<std::unique_ptr<OffscreenContext>> create_egl_context(bool es3) {
  auto context = std::make_unique<EglContext>();
  RELIT_TRY(context->open(es3));
  return std::unique_ptr<OffscreenContext>(std::move(context));
}

}  // namespace relit::gles::detail
