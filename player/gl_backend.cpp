// SPDX-License-Identifier: MIT
#include "player/gl_backend.hpp"

#include <array>
#include <optional>

namespace relit::player {
namespace {

struct BackendName {
  Backend backend;
  const char* name;
};
constexpr std::array<BackendName, 5> kBackends{{{Backend::kEgl, "egl"},
                                                {Backend::kEglEs2, "egl-es2"},
                                                {Backend::kEglEs2Mediump, "egl-es2-mediump"},
                                                {Backend::kOsmesa, "osmesa"},
                                                {Backend::kCpu, "cpu"}}};

Result<GlBackend> open_kind(gles::OffscreenKind kind, std::optional<gles::Profile> profile) {
  GlBackend backend;
  RELIT_ASSIGN(backend.context, gles::OffscreenContext::create(kind));
  gles::DeviceOptions options;
  options.get_proc_address = backend.context->get_proc_address();
  options.profile = profile;
  RELIT_ASSIGN(backend.device, gles::Device::create(options));
  return backend;
}

}  // namespace

Result<Backend> parse_backend(const std::string& name) {
  for (const BackendName& known : kBackends) {
    if (name == known.name) return known.backend;
  }
  return fail(ErrorCode::kInvalid,
              "--backend " + name + ": it must be egl, egl-es2, egl-es2-mediump, osmesa or cpu");
}

const char* backend_name(Backend backend) {
  for (const BackendName& known : kBackends) {
    if (backend == known.backend) return known.name;
  }
  return "?";
}

Result<GlBackend> open_backend(Backend backend) {
  switch (backend) {
    case Backend::kEgl:
      return open_kind(gles::OffscreenKind::kEglEs3, gles::Profile::kEs3);
    case Backend::kEglEs2:
      return open_kind(gles::OffscreenKind::kEglEs2, gles::Profile::kEs2);
    case Backend::kEglEs2Mediump:
      return open_kind(gles::OffscreenKind::kEglEs2, gles::Profile::kEs2Mediump);
    case Backend::kOsmesa:
      return open_kind(gles::OffscreenKind::kOsmesa, std::nullopt);
    case Backend::kCpu:
      break;
  }
  auto egl = open_kind(gles::OffscreenKind::kEglEs3, std::nullopt);
  if (egl) return egl;
  auto es2 = open_kind(gles::OffscreenKind::kEglEs2, gles::Profile::kEs2);
  if (es2) return es2;
  auto osmesa = open_kind(gles::OffscreenKind::kOsmesa, std::nullopt);
  if (osmesa) return osmesa;
  return fail(ErrorCode::kEnvironment, egl.error().message + "; " + osmesa.error().message);
}

}  // namespace relit::player
