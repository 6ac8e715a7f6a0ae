// SPDX-License-Identifier: MIT
#include "gles/device.hpp"

#include <thread>

#include "tests/gles/backends.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::gles;
using namespace relit::test;

TEST_CASE("version strings are understood or refused", "[gles]") {
  auto es = parse_version("OpenGL ES 3.2 Mesa 22.3.6");
  REQUIRE(es);
  CHECK(es->is_es);
  CHECK(es->major == 3);
  CHECK(es->minor == 2);
  CHECK(es->es_major() == 3);
  auto old = parse_version("OpenGL ES 2.0 (build 1.4@2417620)");
  REQUIRE(old);
  CHECK(old->es_major() == 2);
  auto desktop = parse_version("4.5 (Core Profile) Mesa 22.3.6");
  REQUIRE(desktop);
  CHECK_FALSE(desktop->is_es);
  CHECK(desktop->es_major() == 3);
  for (const char* text : {"", "OpenGL ES", "OpenGL ES-CM 1.1", "OpenGL ES 1.1", "2.1 Mesa",
                           "OpenGL ES 3", "garbage", "3.", "OpenGL ES x.y"})
    CHECK(parse_version(text).error().code == ErrorCode::kEnvironment);
}

TEST_CASE("extensions match as whole words", "[gles]") {
  CHECK(has_word("GL_A GL_B", "GL_A"));
  CHECK(has_word("GL_A GL_B", "GL_B"));
  CHECK(has_word("GL_AB GL_A", "GL_A"));
  CHECK_FALSE(has_word("GL_AB GL_BA", "GL_A"));
  CHECK_FALSE(has_word("", "GL_A"));
}

TEST_CASE("a device knows its context", "[gles][es2]") {
  on_each_backend([&](const Device& device, const Backend& backend) {
    const Capabilities& caps = device.caps();
    CHECK(device.profile() == backend.profile);
    CHECK(caps.es_major == (backend.profile == Profile::kEs3 ? 3 : 2));
    CHECK(caps.fragment_highp);
    CHECK(caps.half_float_target);
    CHECK(caps.max_texture_size >= 2048);
    CHECK(caps.max_texture_units >= 8);
    CHECK(caps.max_varying_vectors >= 8);
    CHECK_FALSE(caps.renderer.empty());
    // Nothing of ES 3 can be called by mistake.
    CHECK((device.gl().BlitFramebuffer != nullptr) == device.is_es3());
  });
}

TEST_CASE("ignored extensions count as absent", "[gles][es2]") {
  on_each_backend(
      [&](const Device& device, const Backend&) {
        CHECK_FALSE(device.caps().half_float_target);
        CHECK_FALSE(device.caps().npot_repeat);
        CHECK_FALSE(device.caps().unpack_row_length);
      },
      {"GL_EXT_color_buffer_half_float GL_OES_texture_npot GL_EXT_unpack_subimage", false});
}

TEST_CASE("a device says what its context lacks", "[gles][es2]") {
  CHECK(Device::create({}).error().code == ErrorCode::kInvalid);
  const auto nothing = Device::create({[](const char*) -> void* { return nullptr; }, {}, {}});
  REQUIRE_FALSE(nothing);
  CHECK(nothing.error().code == ErrorCode::kEnvironment);
  CHECK(nothing.error().message.find("glActiveTexture") != std::string::npos);
}

TEST_CASE("shaders that do not compile give the driver's log", "[gles][es2]") {
  on_each_backend([&](const Device& device, const Backend&) {
    const std::string_view vertex[] = {"void main() { gl_Position = vec4(0.0); }\n"};
    const std::string_view fragment[] = {"void main() { FRAG_COLOR = undeclared; }\n"};
    const auto program =
        build_program(device.gl(), device.profile(), {"broken", "", vertex, fragment, {}});
    REQUIRE_FALSE(program);
    CHECK(program.error().code == ErrorCode::kEnvironment);
    CHECK(program.error().message.find("undeclared") != std::string::npos);
    CHECK(program.error().message.find("broken") != std::string::npos);
  });
}

TEST_CASE("a context moves from thread to thread", "[gles]") {
  std::unique_ptr<OffscreenContext> context;
  auto create = [&] {
    auto created = OffscreenContext::create(OffscreenKind::kEglEs2);
    if (created) context = std::move(*created);
    if (context) context->release_current();
  };
  std::thread(create).join();
  REQUIRE(context);
  bool usable = false;
  std::thread([&] {
    usable = context->make_current().has_value() &&
             Device::create({context->get_proc_address(), Profile::kEs2, {}}).has_value();
    context.reset();
  }).join();
  CHECK(usable);
}

TEST_CASE("EGL and OSMesa refuse to share a thread", "[gles]") {
  auto osmesa = OffscreenContext::create(OffscreenKind::kOsmesa);
  if (!osmesa) {
    WARN("skipped: " << osmesa.error().message);
    return;
  }
  ErrorCode code{};
  std::thread([&] {
    auto egl = OffscreenContext::create(OffscreenKind::kEglEs2);
    auto second = OffscreenContext::create(OffscreenKind::kOsmesa);
    if (egl && !second) code = second.error().code;
  }).join();
  CHECK(code == ErrorCode::kEnvironment);
}
