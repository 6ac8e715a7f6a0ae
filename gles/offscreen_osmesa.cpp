// SPDX-License-Identifier: MIT
#include <dlfcn.h>

#include <array>
#include <bit>
#include <vector>

#include "gles/offscreen.hpp"

namespace relit::gles::detail {
namespace {

// From GL/osmesa.h, which would drag desktop OpenGL's header in.
constexpr int kFormat = 0x22;
constexpr int kDepthBits = 0x30;
constexpr int kProfile = 0x33;
constexpr int kCoreProfile = 0x34;
constexpr int kContextMajor = 0x36;
constexpr int kContextMinor = 0x37;

using OsmesaContextHandle = void*;

struct Osmesa {
  OsmesaContextHandle (*create)(const int* attributes, OsmesaContextHandle share) = nullptr;
  void (*destroy)(OsmesaContextHandle) = nullptr;
  GLboolean (*make_current)(OsmesaContextHandle, void* buffer, GLenum type, GLsizei width,
                            GLsizei height) = nullptr;
  void* (*get_proc_address)(const char*) = nullptr;
  std::string problem;

  void load();
};

void Osmesa::load() {
  // RTLD_LOCAL: its gl* symbols clash with those of libGLESv2.
  void* library = dlopen("libOSMesa.so.8", RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  if (library == nullptr) {
    problem = std::string("OSMesa cannot be loaded (") + dlerror() +
              "); install libosmesa6, or use --backend egl";
    return;
  }
  create = std::bit_cast<decltype(create)>(dlsym(library, "OSMesaCreateContextAttribs"));
  destroy = std::bit_cast<decltype(destroy)>(dlsym(library, "OSMesaDestroyContext"));
  make_current = std::bit_cast<decltype(make_current)>(dlsym(library, "OSMesaMakeCurrent"));
  get_proc_address =
      std::bit_cast<decltype(get_proc_address)>(dlsym(library, "OSMesaGetProcAddress"));
  if (create == nullptr || destroy == nullptr || make_current == nullptr ||
      get_proc_address == nullptr)
    problem = "libOSMesa.so.8 lacks OSMesaCreateContextAttribs; version 12 or later is needed";
}

const Osmesa& osmesa() {
  static const Osmesa instance = [] {
    Osmesa loaded;
    loaded.load();
    return loaded;
  }();
  return instance;
}

class OsmesaContext final : public OffscreenContext {
 public:
  Status open();
  ~OsmesaContext() override;
  Status make_current() override;
  void release_current() override;
  [[nodiscard]] GetProcAddress get_proc_address() const override;

 private:
  // OSMesa wants a window's memory. Pictures are drawn into framebuffer objects, so it can be
  // small.
  static constexpr int kSide = 16;

  OsmesaContextHandle context_ = nullptr;
  std::vector<std::uint8_t> buffer_ = std::vector<std::uint8_t>(std::size_t{kSide} * kSide * 4);
};

Status OsmesaContext::open() {
  const Osmesa& o = osmesa();
  if (!o.problem.empty()) return fail(ErrorCode::kEnvironment, o.problem);
  const std::array<int, 11> attributes{
      kFormat,       GL_RGBA, kDepthBits,    0, kProfile, kCoreProfile,
      kContextMajor, 3,       kContextMinor, 3, 0};
  context_ = o.create(attributes.data(), nullptr);
  if (context_ == nullptr)
    return fail(ErrorCode::kEnvironment,
                "OSMesa cannot create an OpenGL 3.3 core context; Mesa 17 or later is needed");
  return make_current();
}

OsmesaContext::~OsmesaContext() {
  if (context_ == nullptr) return;
  release_current();
  osmesa().destroy(context_);
}

Status OsmesaContext::make_current() {
  RELIT_TRY(claim_thread(ThreadUse::kOsmesa));
  if (osmesa().make_current(context_, buffer_.data(), GL_UNSIGNED_BYTE, kSide, kSide) != GL_TRUE)
    return fail(ErrorCode::kEnvironment, "OSMesaMakeCurrent failed");
  return {};
}

void OsmesaContext::release_current() { osmesa().make_current(nullptr, nullptr, 0, 0, 0); }

GetProcAddress OsmesaContext::get_proc_address() const {
  return [](const char* name) { return osmesa().get_proc_address(name); };
}

}  // namespace

Result<std::unique_ptr<OffscreenContext>> create_osmesa_context() {
  auto context = std::make_unique<OsmesaContext>();
  RELIT_TRY(context->open());
  return std::unique_ptr<OffscreenContext>(std::move(context));
}

}  // namespace relit::gles::detail
