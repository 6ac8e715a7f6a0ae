// SPDX-License-Identifier: MIT
// A context that is not current, was lost, or is gone: errors, and no crash.
#include <cstring>
#include <optional>

#include "gles/character_renderer.hpp"
#include "gles/compositor.hpp"
#include "gles/light_map_mixer.hpp"
#include "gles/picture.hpp"
#include "tests/gles/backends.hpp"
#include "tests/gles/drawing.hpp"
#include "tests/gles/plane_scene.hpp"
#include "tests/results.hpp"
#include "tests/test.hpp"

namespace {

using namespace relit;
using namespace relit::gles;
using namespace relit::test;

// One of everything, on a device of its own.
struct Objects {
  explicit Objects(const Device& device)
      : scene({"lost", 16, 16, 2, 8, false, 0}),
        compositor(take(Compositor::create(device, scene.description_))),
        uploader(take(LightMapUploader::create(device, 16, 16))),
        mixer(take(LightMapMixer::create(device, 16, 16))),
        framebuffer(take(Framebuffer::create(device, {16, 16, 4}))),
        renderer(take(CharacterRenderer::create(device))),
        light(constant_light(16, 16, {0.5f, 0.5f, 0.5f})) {
    const MeshView mesh = quad.view();
    require(renderer->set_materials({}, std::span(&material, 1)));
    require(renderer->set_meshes(std::span(&mesh, 1)));
    require(renderer->update_positions(0, quad.positions));
    require(compositor->upload(scene.views_, 0));
    map = take(compositor->composite(scene.light_));
    uploaded = take(uploader.upload(light, 1));
    view.width = view.height = 16;
  }

  // Everything that talks to GL.
  void check_refusals(const Device& device, const std::string& reason) {
    auto refused = [&](const auto& result) {
      if (result) FAIL("an operation that should have failed did not");
      CHECK(result.error().code == ErrorCode::kEnvironment);
      CAPTURE(result.error().message);
      CHECK(result.error().message.find(reason) != std::string::npos);
    };
    std::vector<float> floats(3 * 16 * 16);
    std::vector<std::uint8_t> bytes(4 * 16 * 16);
    refused(Compositor::create(device, scene.description_));
    refused(compositor->upload(scene.views_, 0));
    refused(compositor->composite(scene.light_));
    refused(compositor->read_back(floats));
    refused(LightMapUploader::create(device, 16, 16));
    refused(uploader.upload(light, 1));
    refused(LightMapMixer::create(device, 16, 16));
    refused(mixer.mix(map, uploaded, 0.5f));
    refused(mixer.read_back(floats));
    refused(Framebuffer::create(device, {16, 16, 1}));
    refused(framebuffer.resolve());
    refused(framebuffer.read_back(bytes));
    refused(framebuffer.present(0, 16, 16));
    refused(CharacterRenderer::create(device));
    const MeshView mesh = quad.view();
    refused(renderer->set_materials({}, std::span(&material, 1)));
    refused(renderer->set_meshes(std::span(&mesh, 1)));
    refused(renderer->update_positions(0, quad.positions));
    refused(renderer->background().set({}));
    refused(renderer->draw(view, map));
    if (device.profile() != Profile::kEs2Mediump)
      refused(renderer->draw(view, *take(compositor->fuse(scene.light_, {0, -1, 0}))));
  }

  Scene scene;
  Quad quad;
  MaterialView material;
  View view;
  std::unique_ptr<Compositor> compositor;
  LightMapUploader uploader;
  LightMapMixer mixer;
  Framebuffer framebuffer;
  std::unique_ptr<CharacterRenderer> renderer;
  std::vector<float> light;
  LightMap map, uploaded;
};

thread_local GLenum reset_status = GL_NO_ERROR;
GLenum GL_APIENTRY give_reset_status() { return reset_status; }

}  // namespace

TEST_CASE("operations fail while the context is not current, and work again after", "[gles][es2]") {
  on_each_backend([&](const Device& device, const Backend&) {
    Objects objects(device);
    backend_context().release_current();
    objects.check_refusals(device, "not current");
    const auto other = Device::create({backend_context().get_proc_address(), {}, {}});
    REQUIRE_FALSE(other);
    CHECK(other.error().code == ErrorCode::kEnvironment);
    require(backend_context().make_current());
    require(objects.compositor->upload(objects.scene.views_, 1));
    take(objects.compositor->composite(objects.scene.light_));
  });
}

TEST_CASE("operations fail when the driver says that the context was lost", "[gles]") {
  on_each_backend([&](const Device& clean, const Backend& backend) {
    if (clean.caps().reset_status == nullptr) return;
    const GetProcAddress real = backend_context().get_proc_address();
    const GetProcAddress get = [&](const char* name) {
      if (std::strstr(name, "GraphicsResetStatus") == nullptr) return real(name);
      return reinterpret_cast<void*>(give_reset_status);
    };
    auto device = take(Device::create({get, backend.profile, {}}));
    Objects objects(*device);
    reset_status = 0x8255;  // GL_UNKNOWN_CONTEXT_RESET
    objects.check_refusals(*device, "was lost");
    reset_status = GL_NO_ERROR;
  });
}

TEST_CASE("objects of an abandoned device go without a context", "[gles][es2]") {
  on_each_backend([&](const Device&, const Backend& backend) {
    auto device = take(Device::create({backend_context().get_proc_address(), backend.profile, {}}));
    std::optional<Objects> objects(std::in_place, *device);
    device->abandon();
    objects->check_refusals(*device, "abandoned");
    backend_context().release_current();
    objects.reset();
    device.reset();
    require(backend_context().make_current());
  });
}
