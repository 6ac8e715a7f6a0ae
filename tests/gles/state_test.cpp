// SPDX-License-Identifier: MIT
// The GL state that gles/device.hpp says is required, and left: a host that has dirtied everything
// gets the same picture, bit for bit, and finds the state as documented.
#include <array>
#include <cstring>
#include <functional>
#include <initializer_list>

#include "gles/character_renderer.hpp"
#include "gles/compositor.hpp"
#include "gles/light_map_mixer.hpp"
#include "gles/overlay.hpp"
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

constexpr int kSide = 32;
constexpr int kUnits = 8;

// Entry points that only a host calls.
struct HostFunctions {
  explicit HostFunctions(const GetProcAddress& get) {
    auto load = [&]<class F>(F& f, const char* name) { f = reinterpret_cast<F>(get(name)); };
    load(StencilFunc, "glStencilFunc");
    load(StencilOp, "glStencilOp");
    load(PolygonOffset, "glPolygonOffset");
    load(SampleCoverage, "glSampleCoverage");
    load(LineWidth, "glLineWidth");
    load(BlendColor, "glBlendColor");
    load(BlendEquationSeparate, "glBlendEquationSeparate");
    load(ClearStencil, "glClearStencil");
    load(GenSamplers, "glGenSamplers");
    load(DeleteSamplers, "glDeleteSamplers");
    load(SamplerParameteri, "glSamplerParameteri");
    load(BindBufferBase, "glBindBufferBase");
    load(IsEnabled, "glIsEnabled");
    load(GetVertexAttribiv, "glGetVertexAttribiv");
    load(GetVertexAttribfv, "glGetVertexAttribfv");
    load(GetBooleanv, "glGetBooleanv");
  }
  PFNGLSTENCILFUNCPROC StencilFunc = nullptr;
  PFNGLSTENCILOPPROC StencilOp = nullptr;
  PFNGLPOLYGONOFFSETPROC PolygonOffset = nullptr;
  PFNGLSAMPLECOVERAGEPROC SampleCoverage = nullptr;
  PFNGLLINEWIDTHPROC LineWidth = nullptr;
  PFNGLBLENDCOLORPROC BlendColor = nullptr;
  PFNGLBLENDEQUATIONSEPARATEPROC BlendEquationSeparate = nullptr;
  PFNGLCLEARSTENCILPROC ClearStencil = nullptr;
  PFNGLGENSAMPLERSPROC GenSamplers = nullptr;
  PFNGLDELETESAMPLERSPROC DeleteSamplers = nullptr;
  PFNGLSAMPLERPARAMETERIPROC SamplerParameteri = nullptr;
  PFNGLBINDBUFFERBASEPROC BindBufferBase = nullptr;
  PFNGLISENABLEDPROC IsEnabled = nullptr;
  PFNGLGETVERTEXATTRIBIVPROC GetVertexAttribiv = nullptr;
  PFNGLGETVERTEXATTRIBFVPROC GetVertexAttribfv = nullptr;
  PFNGLGETBOOLEANVPROC GetBooleanv = nullptr;
};

// What a host has of its own, and leaves bound everywhere.
class Host {
 public:
  Host(const Device& device, const GetProcAddress& get)
      : device_(device), gl_(device.gl()), more_(get) {
    gl_.GenTextures(2, textures_.data());
    gl_.BindTexture(GL_TEXTURE_2D, textures_[0]);
    const std::array<std::uint8_t, 4> pink{255, 0, 255, 7};
    gl_.TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA, 1, 1, 0, GL_RGBA, GL_UNSIGNED_BYTE, pink.data());
    gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl_.BindTexture(GL_TEXTURE_2D, 0);
    gl_.BindTexture(GL_TEXTURE_CUBE_MAP, textures_[1]);
    gl_.BindTexture(GL_TEXTURE_CUBE_MAP, 0);
    gl_.GenBuffers(1, &buffer_);
    gl_.BindBuffer(GL_ARRAY_BUFFER, buffer_);
    const std::vector<std::uint8_t> bytes(1 << 16, 0x5A);
    gl_.BufferData(GL_ARRAY_BUFFER, 1 << 16, bytes.data(), GL_STATIC_DRAW);
    gl_.BindBuffer(GL_ARRAY_BUFFER, 0);
    gl_.GenRenderbuffers(1, &renderbuffer_);
    gl_.GenFramebuffers(2, framebuffers_.data());
    for (const GLuint framebuffer : framebuffers_) {
      gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
      gl_.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, textures_[0],
                               0);
    }
    gl_.BindFramebuffer(GL_FRAMEBUFFER, 0);
    if (!device.is_es3()) return;
    gl_.GenVertexArrays(1, &array_);
    more_.GenSamplers(1, &sampler_);
    more_.SamplerParameteri(sampler_, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    more_.SamplerParameteri(sampler_, GL_TEXTURE_WRAP_S, GL_MIRRORED_REPEAT);
  }
  ~Host() {
    gl_.DeleteTextures(2, textures_.data());
    gl_.DeleteBuffers(1, &buffer_);
    gl_.DeleteRenderbuffers(1, &renderbuffer_);
    gl_.DeleteFramebuffers(2, framebuffers_.data());
    if (!device_.is_es3()) return;
    gl_.DeleteVertexArrays(1, &array_);
    more_.DeleteSamplers(1, &sampler_);
  }

  // `framebuffer`: which is bound for drawing; 0: one of the host's own.
  void make_a_mess(GLuint framebuffer = 0) {
    dirty_tests();
    dirty_pixel_store();
    dirty_bindings(framebuffer != 0 ? framebuffer : framebuffers_[0]);
    CHECK(gl_.GetError() == GLenum{GL_NO_ERROR});
  }

  // What gles/device.hpp promises to leave. `framebuffer` as given to make_a_mess().
  void check_left(int units, GLuint framebuffer = 0) {
    check_switches();
    check_values();
    check_bindings(units, framebuffer != 0 ? framebuffer : framebuffers_[0]);
    CHECK(gl_.GetError() == GLenum{GL_NO_ERROR});
  }

 private:
  static constexpr std::array<GLenum, 8> kOff{
      GL_BLEND,        GL_DEPTH_TEST,          GL_CULL_FACE,       GL_SCISSOR_TEST,
      GL_STENCIL_TEST, GL_POLYGON_OFFSET_FILL, GL_SAMPLE_COVERAGE, GL_SAMPLE_ALPHA_TO_COVERAGE};

  void dirty_tests() {
    for (const GLenum state : kOff) gl_.Enable(state);
    gl_.Disable(GL_DITHER);
    if (device_.is_es3()) gl_.Enable(GL_RASTERIZER_DISCARD);
    gl_.BlendFuncSeparate(GL_ZERO, GL_DST_ALPHA, GL_ONE, GL_ZERO);
    more_.BlendEquationSeparate(GL_FUNC_REVERSE_SUBTRACT, GL_FUNC_SUBTRACT);
    more_.BlendColor(0.1f, 0.2f, 0.3f, 0.4f);
    gl_.DepthFunc(GL_NEVER);
    gl_.DepthRangef(0.9f, 0.1f);
    gl_.DepthMask(GL_FALSE);
    gl_.ColorMask(GL_FALSE, GL_TRUE, GL_FALSE, GL_FALSE);
    gl_.CullFace(GL_FRONT_AND_BACK);
    gl_.FrontFace(GL_CW);
    more_.StencilFunc(GL_NEVER, 3, 0xFF);
    more_.StencilOp(GL_INVERT, GL_INVERT, GL_INVERT);
    more_.PolygonOffset(-50, -1000);
    more_.SampleCoverage(0, GL_FALSE);
    more_.LineWidth(1);
    more_.ClearStencil(5);
    gl_.ClearColor(0.9f, 0.8f, 0.7f, 0.6f);
    gl_.ClearDepthf(0);
    gl_.Viewport(3, 5, 7, 11);
    gl_.Scissor(1, 2, 3, 4);
  }

  void dirty_pixel_store() {
    gl_.PixelStorei(GL_UNPACK_ALIGNMENT, 8);
    gl_.PixelStorei(GL_PACK_ALIGNMENT, 8);
    if (device_.is_es3() || device_.caps().unpack_row_length) {
      gl_.PixelStorei(GL_UNPACK_ROW_LENGTH, 77);
      gl_.PixelStorei(GL_UNPACK_SKIP_ROWS, 3);
      gl_.PixelStorei(GL_UNPACK_SKIP_PIXELS, 5);
    }
    if (!device_.is_es3()) return;
    gl_.PixelStorei(GL_UNPACK_IMAGE_HEIGHT, 99);
    gl_.PixelStorei(GL_UNPACK_SKIP_IMAGES, 1);
    gl_.PixelStorei(GL_PACK_ROW_LENGTH, 1234);
    gl_.PixelStorei(GL_PACK_SKIP_ROWS, 2);
    gl_.PixelStorei(GL_PACK_SKIP_PIXELS, 3);
  }

  void dirty_bindings(GLuint framebuffer) {
    const int arrays = device_.caps().max_vertex_attributes;
    if (device_.is_es3()) gl_.BindVertexArray(array_);
    gl_.BindBuffer(GL_ARRAY_BUFFER, buffer_);
    gl_.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffer_);
    for (int i = 0; i < arrays; ++i) {
      gl_.VertexAttribPointer(static_cast<GLuint>(i), 3, GL_SHORT, GL_TRUE, 12, nullptr);
      gl_.EnableVertexAttribArray(static_cast<GLuint>(i));
      gl_.VertexAttrib4f(static_cast<GLuint>(i), 0.1f, 0.2f, 0.3f, 0.4f);
    }
    gl_.BindRenderbuffer(GL_RENDERBUFFER, renderbuffer_);
    for (int unit = 0; unit < kUnits; ++unit) {
      gl_.ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
      gl_.BindTexture(GL_TEXTURE_2D, textures_[0]);
      gl_.BindTexture(GL_TEXTURE_CUBE_MAP, textures_[1]);
    }
    gl_.ActiveTexture(GL_TEXTURE5);
    if (!device_.is_es3()) {
      gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
      return;
    }
    for (GLuint unit = 0; unit < kUnits; ++unit) gl_.BindSampler(unit, sampler_);
    gl_.BindBuffer(GL_PIXEL_UNPACK_BUFFER, buffer_);
    gl_.BindBuffer(GL_PIXEL_PACK_BUFFER, buffer_);
    more_.BindBufferBase(GL_UNIFORM_BUFFER, 0, buffer_);
    gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
    gl_.BindFramebuffer(GL_READ_FRAMEBUFFER, framebuffers_[1]);
  }

  void check_switches() {
    for (const GLenum state : kOff) {
      CAPTURE(state);
      CHECK(gl_.IsEnabled(state) == GLboolean{GL_FALSE});
    }
    CHECK(gl_.IsEnabled(GL_DITHER) == GLboolean{GL_TRUE});
    if (device_.is_es3()) CHECK(gl_.IsEnabled(GL_RASTERIZER_DISCARD) == GLboolean{GL_FALSE});
    std::array<GLboolean, 4> mask{};
    more_.GetBooleanv(GL_COLOR_WRITEMASK, mask.data());
    CHECK(mask == std::array<GLboolean, 4>{1, 1, 1, 1});
    more_.GetBooleanv(GL_DEPTH_WRITEMASK, mask.data());
    CHECK(mask[0] == GLboolean{1});
  }

  void check_value(GLenum name, GLint expected) {
    GLint value = -77;
    gl_.GetIntegerv(name, &value);
    CAPTURE(name);
    CHECK(value == expected);
  }

  void check_values() {
    check_value(GL_BLEND_EQUATION_RGB, GL_FUNC_ADD);
    check_value(GL_BLEND_EQUATION_ALPHA, GL_FUNC_ADD);
    check_value(GL_BLEND_SRC_RGB, GL_ONE);
    check_value(GL_BLEND_DST_RGB, GL_ZERO);
    check_value(GL_BLEND_SRC_ALPHA, GL_ONE);
    check_value(GL_BLEND_DST_ALPHA, GL_ZERO);
    check_value(GL_DEPTH_FUNC, GL_LESS);
    check_value(GL_CULL_FACE_MODE, GL_BACK);
    check_value(GL_FRONT_FACE, GL_CCW);
    check_value(GL_UNPACK_ALIGNMENT, 4);
    check_value(GL_PACK_ALIGNMENT, 4);
    std::array<GLfloat, 4> values{};
    gl_.GetFloatv(GL_DEPTH_RANGE, values.data());
    CHECK((values[0] == 0 && values[1] == 1));
    gl_.GetFloatv(GL_COLOR_CLEAR_VALUE, values.data());
    CHECK(values == std::array<GLfloat, 4>{0, 0, 0, 0});
    gl_.GetFloatv(GL_DEPTH_CLEAR_VALUE, values.data());
    CHECK(values[0] == 1);
    std::array<GLint, 4> box{};
    gl_.GetIntegerv(GL_VIEWPORT, box.data());
    CHECK(box == std::array<GLint, 4>{3, 5, 7, 11});
    gl_.GetIntegerv(GL_SCISSOR_BOX, box.data());
    CHECK(box == std::array<GLint, 4>{1, 2, 3, 4});
    // The host's, and left alone.
    check_value(GL_STENCIL_CLEAR_VALUE, 5);
    check_value(GL_STENCIL_FUNC, GL_NEVER);
    if (!device_.is_es3()) return;
    for (const GLenum name : std::initializer_list<GLenum>{
             GL_UNPACK_ROW_LENGTH, GL_UNPACK_SKIP_ROWS, GL_UNPACK_SKIP_PIXELS,
             GL_UNPACK_IMAGE_HEIGHT, GL_UNPACK_SKIP_IMAGES, GL_PACK_ROW_LENGTH, GL_PACK_SKIP_ROWS,
             GL_PACK_SKIP_PIXELS})
      check_value(name, 0);
  }

  void check_bindings(int units, GLuint framebuffer) {
    for (const GLenum name :
         std::initializer_list<GLenum>{GL_CURRENT_PROGRAM, GL_ARRAY_BUFFER_BINDING,
                                       GL_ELEMENT_ARRAY_BUFFER_BINDING, GL_RENDERBUFFER_BINDING})
      check_value(name, 0);
    check_value(GL_ACTIVE_TEXTURE, GL_TEXTURE0);
    check_value(GL_FRAMEBUFFER_BINDING, static_cast<GLint>(framebuffer));
    for (int unit = kUnits; unit-- > 0;) {
      gl_.ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
      CAPTURE(unit, units);
      if (unit >= units) continue;
      check_value(GL_TEXTURE_BINDING_2D, 0);
      check_value(GL_TEXTURE_BINDING_CUBE_MAP, 0);
      if (device_.is_es3()) check_value(GL_SAMPLER_BINDING, 0);
    }
    if (!device_.is_es3()) {
      for (int i = 0; i < device_.caps().max_vertex_attributes; ++i) {
        GLint enabled = 1;
        more_.GetVertexAttribiv(static_cast<GLuint>(i), GL_VERTEX_ATTRIB_ARRAY_ENABLED, &enabled);
        CHECK(enabled == 0);
      }
      return;
    }
    check_value(GL_VERTEX_ARRAY_BINDING, 0);
    check_value(GL_PIXEL_UNPACK_BUFFER_BINDING, 0);
    check_value(GL_PIXEL_PACK_BUFFER_BINDING, 0);
    check_value(GL_READ_FRAMEBUFFER_BINDING, static_cast<GLint>(framebuffers_[1]));
  }

  const Device& device_;
  const Functions& gl_;
  HostFunctions more_;
  std::array<GLuint, 2> textures_{};
  GLuint buffer_ = 0, renderbuffer_ = 0, array_ = 0, sampler_ = 0;
  std::array<GLuint, 2> framebuffers_{};
};

// Everything this folder can do, once, with `before` and `after` around each public operation.
struct Everything {
  using Around = std::function<void(int units)>;
  Around before = [](int) {};
  Around after = [](int) {};

  std::vector<std::uint8_t> pixels;
  std::vector<float> light;

  void run(const Device& device, const Scene& scene, const std::function<void(GLuint, int)>& aim) {
    auto around = [&](int units, auto&& operation) {
      before(units);
      auto result = operation();
      after(units);
      if (!result) FAIL(result.error().message);
      return std::move(*result);
    };
    auto step = [&](int units, auto&& operation) {
      before(units);
      const Status status = operation();
      after(units);
      require(status);
    };
    auto compositor = around(1, [&] { return Compositor::create(device, scene.description_); });
    step(1, [&] { return compositor->upload(scene.views_, 0); });
    step(1, [&] { return compositor->upload(scene.views_, 1); });
    const LightMap map = around(2, [&] {
      return compositor->composite(scene.light_, {0, 1, 0.25f});
    });
    light.resize(3 * static_cast<std::size_t>(scene.width_ * scene.height_));
    step(1, [&] { return compositor->read_back(light); });
    std::vector<float> changed = light;
    for (float& value : changed) value = 0.25f * value + 0.1f;
    auto uploader =
        around(1, [&] { return LightMapUploader::create(device, scene.width_, scene.height_); });
    const LightMap uploaded = around(1, [&] { return uploader.upload(changed, 1); });
    auto mixer =
        around(1, [&] { return LightMapMixer::create(device, scene.width_, scene.height_); });
    const LightMap mixed = around(2, [&] { return mixer.mix(map, uploaded, 0.5f); });
    step(1, [&] { return mixer.read_back(changed); });
    light.insert(light.end(), changed.begin(), changed.end());

    auto renderer = around(1, [&] { return CharacterRenderer::create(device); });
    const std::vector<std::uint8_t> texels{200, 100, 50, 255, 50, 100, 200, 128,
                                           10,  20,  30, 255, 99, 88,  77,  0};
    const ImageView image{2, 2, texels};
    std::array<MaterialView, 2> materials{};
    materials[0].image = materials[1].image = 0;
    materials[1].alpha_mode = AlphaMode::kBlend;
    step(1, [&] { return renderer->set_materials(std::span(&image, 1), materials); });
    const Quad back(2, 0.9f, -0.2f), front(1, 0.5f, 0.2f);
    const std::array<MeshView, 2> meshes{back.view(0), front.view(1)};
    step(1, [&] { return renderer->set_meshes(meshes); });
    // These two bind nothing but what they leave unbound.
    require(renderer->update_positions(0, back.positions));
    require(renderer->update_positions(1, front.positions));
    const std::array<std::array<float, 3>, 1> ambient{{{0.5f, 0.4f, 0.3f}}};
    Background background;
    background.kind = Background::Kind::kHarmonics;
    background.harmonics = ambient;
    step(1, [&] { return renderer->background().set(background); });

    auto framebuffer = around(1, [&] { return Framebuffer::create(device, {kSide, kSide, 4}); });
    View view;
    view.x = 2, view.y = 1;
    view.width = framebuffer.draw_width() - 4, view.height = framebuffer.draw_height() - 3;
    auto shoot = [&](int units, auto&& draw) {
      framebuffer.bind();
      GLint bound = 0;
      device.gl().GetIntegerv(GL_FRAMEBUFFER_BINDING, &bound);
      device.gl().ClearColor(0, 0, 0, 0);
      device.gl().Clear(GL_COLOR_BUFFER_BIT);
      aim(static_cast<GLuint>(bound), units);
      const Status drawn = draw();
      aim(0, units);
      require(drawn);
      step(1, [&] { return framebuffer.resolve(); });
      std::vector<std::uint8_t> rgba(4 * kSide * kSide);
      step(1, [&] { return framebuffer.read_back(rgba); });
      pixels.insert(pixels.end(), rgba.begin(), rgba.end());
    };
    shoot(2, [&] { return renderer->draw(view, mixed); });
    auto overlay = around(1, [&] { return Overlay::create(device); });
    OverlayCanvas canvas;
    canvas.begin(framebuffer.draw_width(), framebuffer.draw_height(), 1);
    canvas.panel({1, 1, canvas.width() - 2, canvas.height() - 2}, {255, 128, 40, 128});
    canvas.text(2, 0, "a", {});
    shoot(1, [&] { return overlay->draw(canvas); });
    if (device.profile() != Profile::kEs2Mediump) {
      FusedLight* fused = take(compositor->fuse(scene.light_, {0, 1, 0.25f}));  // calls no GL
      shoot(2, [&] { return renderer->draw(view, *fused); });
    }
  }
};

}  // namespace

TEST_CASE("a host that has dirtied all GL state gets the same picture and the promised state",
          "[gles][es2]") {
  const Scene scene({"state", 24, 20, 4, 8, true, 2});
  on_each_backend([&](const Device& clean, const Backend& backend) {
    Everything expected;
    expected.run(clean, scene, [](GLuint, int) {});

    // A device of its own, made amidst the mess: the same context serves both.
    const GetProcAddress get = backend_context().get_proc_address();
    Host host(clean, get);
    host.make_a_mess();
    auto device = take(Device::create({get, backend.profile, {}}));
    host.check_left(1);
    Everything dirty;
    dirty.before = [&](int) { host.make_a_mess(); };
    dirty.after = [&](int units) { host.check_left(units); };
    GLuint target = 0;
    dirty.run(*device, scene, [&](GLuint framebuffer, int units) {
      if (framebuffer != 0) {
        target = framebuffer;
        host.make_a_mess(target);
      } else {
        host.check_left(units, target);
      }
    });
    CHECK(dirty.light == expected.light);
    REQUIRE(dirty.pixels.size() == expected.pixels.size());
    CHECK(std::memcmp(dirty.pixels.data(), expected.pixels.data(), expected.pixels.size()) == 0);
    // And it is a picture.
    CHECK(std::count(expected.pixels.begin(), expected.pixels.end(), 0) <
          static_cast<std::ptrdiff_t>(expected.pixels.size() / 2));
    clean.gl().BindFramebuffer(GL_FRAMEBUFFER, 0);
  });
}
