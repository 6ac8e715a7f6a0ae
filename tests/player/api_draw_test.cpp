// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstring>
#include <exception>
#include <functional>
#include <glm/gtc/type_ptr.hpp>
#include <thread>

#include "decoders/image.hpp"
#include "gles/picture.hpp"
#include "player/camera.hpp"
#include "player/gl_backend.hpp"
#include "player/light.hpp"
#include "tests/player/api_fixture.hpp"

using namespace relit;
using namespace relit::player;
using namespace relit::player::test;

namespace {

constexpr int kSide = 192;
constexpr std::uint64_t kFrame = 21;

using Picture = std::vector<std::uint8_t>;

// Runs `body` on each kind of context, on a thread of its own: EGL and OSMesa must not share one.
void on_contexts(const std::function<void(ApiContext&, gles::Device&)>& body) {
  for (const gles::OffscreenKind kind :
       {gles::OffscreenKind::kEglEs3, gles::OffscreenKind::kEglEs2, gles::OffscreenKind::kOsmesa}) {
    // Assertions may be used on another thread as long as this one waits.
    std::exception_ptr failure;
    std::thread([&] {
      try {
        ApiContext context(kind);
        if (!context.context) {
          WARN("a context is missing: skipped");
          return;
        }
        gles::DeviceOptions options;
        options.get_proc_address = context.find;
        auto device = gles::Device::create(options);
        REQUIRE(device);
        body(context, **device);
      } catch (...) {
        failure = std::current_exception();
      }
    }).join();
    if (failure) std::rethrow_exception(failure);
  }
}

decoders::Light light_of() {
  decoders::Light light;
  for (std::size_t n = 0; n < 4; ++n)
    light.sh.push_back(
        {double{kLight[3 * n]}, double{kLight[3 * n + 1]}, double{kLight[3 * n + 2]}});
  return light;
}

CameraMatrices camera(const float low[3], const float high[3]) {
  return camera_matrices({}, {low[0], low[1], low[2]}, {high[0], high[1], high[2]}, 1);
}

relit_view view_for(relit_player* player) {
  const relit_clip_info clip = clip_of(player);
  const CameraMatrices matrices = camera(clip.bounds_min, clip.bounds_max);
  relit_view view;
  REQUIRE(relit_view_default(&view, sizeof view) == RELIT_OK);
  std::memcpy(view.view, glm::value_ptr(matrices.view), sizeof view.view);
  std::memcpy(view.projection, glm::value_ptr(matrices.projection), sizeof view.projection);
  view.width = view.height = kSide;
  view.background = RELIT_BACKGROUND_TRANSPARENT;
  return view;
}

Picture read_back(gles::Framebuffer& framebuffer) {
  REQUIRE(framebuffer.resolve());
  Picture picture(std::size_t{4} * kSide * kSide);
  REQUIRE(framebuffer.read_back(picture));
  return picture;
}

gles::Framebuffer make_framebuffer(const gles::Device& device) {
  auto framebuffer = gles::Framebuffer::create(device, {kSide, kSide, 1});
  REQUIRE(framebuffer);
  return std::move(*framebuffer);
}

// A player at kFrame under kLight, attached.
struct Attached {
  ApiPlayer player;
  explicit Attached(ApiContext& context, relit_path path) : player(mannequin(), options(path)) {
    REQUIRE(player.result == RELIT_OK);
    const relit_gl_options gl = context.options();
    const relit_result attached = relit_gl_attach(player, &gl);
    INFO(player.error());
    REQUIRE(attached == RELIT_OK);
    REQUIRE(relit_set_light_sh(player, kLight, 4) == RELIT_OK);
    REQUIRE(relit_seek_frame(player, kFrame) == RELIT_OK);
    waited(player);
  }
  static relit_open_options options(relit_path path) {
    relit_open_options options = default_options();
    options.path = path;
    return options;
  }
};

Picture draw(const Attached& attached, const gles::Device& device, const relit_view& view) {
  gles::Framebuffer framebuffer = make_framebuffer(device);
  framebuffer.bind();
  const relit_result drawn = relit_draw(attached.player, &view);
  INFO(attached.player.error());
  REQUIRE(drawn == RELIT_OK);
  return read_back(framebuffer);
}

struct Difference {
  int most = 0;
  double mean = 0;
  std::size_t covered = 0;
};
Difference compare(const Picture& a, const Picture& b) {
  REQUIRE(a.size() == b.size());
  Difference difference;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const int d = std::abs(int{a[i]} - int{b[i]});
    difference.most = std::max(difference.most, d);
    difference.mean += d;
    if (i % 4 == 3 && a[i] > 0) ++difference.covered;
  }
  difference.mean /= static_cast<double>(a.size());
  return difference;
}

}  // namespace

TEST_CASE("api: what it draws is what the command draws") {
  const Folder folder;
  const std::string light = folder.file("light.json"), picture = folder.file("picture.png");
  REQUIRE(write_light_json(light, light_of()));
  on_contexts([&](ApiContext& context, gles::Device& device) {
    const Backend backend = context.kind == gles::OffscreenKind::kEglEs3   ? Backend::kEgl
                            : context.kind == gles::OffscreenKind::kEglEs2 ? Backend::kEglEs2
                                                                           : Backend::kOsmesa;
    std::string says;
    const int status = run_relit("render " + shipped_clip().string() + " --light " + light +
                                     " --frame " + std::to_string(kFrame) + " --size " +
                                     std::to_string(kSide) + "x" + std::to_string(kSide) +
                                     " --samples 1 --exposure 0 --background none --backend " +
                                     backend_name(backend) + " -o " + picture,
                                 &says);
    INFO(says);
    REQUIRE(status == 0);
    const auto drawn = decoders::decode_image(read_bytes(picture), "image/png");
    REQUIRE(drawn);
    Picture expected = drawn->rgba;
    for (const relit_path path : {RELIT_PATH_CPU, RELIT_PATH_TEXTURE, RELIT_PATH_FUSED}) {
      INFO(path);
      const Attached attached(context, path);
      const Picture shown = draw(attached, device, view_for(attached.player));
      // The command's .png has no alpha.
      for (std::size_t i = 3; i < expected.size(); i += 4) expected[i] = shown[i];
      const Difference difference = compare(expected, shown);
      CHECK(difference.covered > 1000);
      // The paths round to half floats in different places, 2^-11 of a value each; after the sRGB
      // curve, whose slope is 12.92 at most, and dithering that is a step or two of 255.
      CHECK(difference.most <= 3);
      CHECK(difference.mean < 0.1);
      CHECK(statistics_of(attached.player).path == path);
    }
  });
}

TEST_CASE("api: a host's own shader draws the light map on the posed vertices alike") {
  on_contexts([](ApiContext& context, gles::Device& device) {
    const Attached attached(context, RELIT_PATH_CPU);
    relit_player* player = attached.player;
    relit_view view = view_for(player);
    view.tone_map = RELIT_TONE_MAP_LINEAR;
    view.exposure = 0.25f;
    const Picture expected = draw(attached, device, view);

    relit_light_map map{};
    map.struct_size = sizeof map;
    REQUIRE(relit_light_map_texture(player, &map) == RELIT_OK);
    CHECK(map.texture != 0);
    const gles::Functions& gl = device.gl();
    const auto compile = [&](GLenum kind, const char* text) {
      const GLuint shader = gl.CreateShader(kind);
      gl.ShaderSource(shader, 1, &text, nullptr);
      gl.CompileShader(shader);
      return shader;
    };
    gles::Program program(gl);
    const GLuint name = program.name();
    const GLuint vertex_shader =
        compile(GL_VERTEX_SHADER,
                "#version 100\n"
                "attribute vec3 a_position; attribute vec2 a_uv; attribute vec2 a_albedo_uv;\n"
                "uniform mat4 u_matrix; varying vec2 v_uv; varying vec2 v_albedo_uv;\n"
                "void main() { v_uv = a_uv; v_albedo_uv = a_albedo_uv;\n"
                "  gl_Position = u_matrix * vec4(a_position, 1.0); }\n");
    const GLuint fragment_shader = compile(
        GL_FRAGMENT_SHADER,
        "#version 100\n"
        "precision highp float; varying vec2 v_uv; varying vec2 v_albedo_uv;\n"
        "uniform highp sampler2D u_map; uniform sampler2D u_albedo; uniform vec4 u_base;\n"
        "uniform float u_scale; uniform bool u_root;\n"
        "vec3 curve(vec3 c, vec3 low, vec3 high, float edge) {\n"
        "  return mix(low, high, step(vec3(edge), c)); }\n"
        "void main() {\n"
        "  vec3 light = texture2D(u_map, v_uv).rgb; if (u_root) light *= light;\n"
        "  vec3 a = texture2D(u_albedo, v_albedo_uv).rgb;\n"
        "  a = curve(a, a / 12.92, pow((a + 0.055) / 1.055, vec3(2.4)), 0.04045);\n"
        "  vec3 c = clamp(max(light, 0.0) * u_scale * a * u_base.rgb, 0.0, 1.0);\n"
        "  gl_FragColor = vec4(curve(c, 12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055,\n"
        "                            0.0031308), 1.0); }\n");
    gl.AttachShader(name, vertex_shader);
    gl.AttachShader(name, fragment_shader);
    gl.BindAttribLocation(name, 0, "a_position");
    gl.BindAttribLocation(name, 1, "a_uv");
    gl.BindAttribLocation(name, 2, "a_albedo_uv");
    gl.LinkProgram(name);
    GLint linked = 0;
    gl.GetProgramiv(name, GL_LINK_STATUS, &linked);
    REQUIRE(linked == GL_TRUE);
    gl.DeleteShader(vertex_shader);
    gl.DeleteShader(fragment_shader);

    gles::Framebuffer framebuffer = make_framebuffer(device);
    framebuffer.bind();
    gl.Viewport(0, 0, kSide, kSide);
    gl.ClearColor(0, 0, 0, 0);
    gl.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    gl.Enable(GL_DEPTH_TEST);
    gl.Enable(GL_CULL_FACE);
    gles::VertexArray array;
    if (device.is_es3()) {
      array = gles::VertexArray(gl);
      gl.BindVertexArray(array.name());
    }
    gl.UseProgram(name);
    const glm::mat4 matrix = glm::make_mat4(view.projection) * glm::make_mat4(view.view);
    gl.UniformMatrix4fv(gl.GetUniformLocation(name, "u_matrix"), 1, GL_FALSE,
                        glm::value_ptr(matrix));
    gl.Uniform1f(gl.GetUniformLocation(name, "u_scale"), map.radiance_scale * view.exposure);
    gl.Uniform1i(gl.GetUniformLocation(name, "u_root"), map.square_root);
    gl.Uniform1i(gl.GetUniformLocation(name, "u_albedo"), 1);
    gl.BindTexture(GL_TEXTURE_2D, map.texture);
    std::vector<gles::Buffer> buffers;
    std::vector<gles::Texture> textures;
    const auto bind = [&](GLenum target, const void* data, std::size_t bytes) {
      buffers.emplace_back(gl);
      gl.BindBuffer(target, buffers.back().name());
      gl.BufferData(target, static_cast<GLsizeiptr>(bytes), data, GL_STATIC_DRAW);
    };
    bool opaque = true;
    for (std::uint32_t m = 0; m < relit_mesh_count(player); ++m) {
      relit_mesh_info mesh{};
      mesh.struct_size = sizeof mesh;
      REQUIRE(relit_mesh(player, m, &mesh) == RELIT_OK);
      relit_material_info material{};
      material.struct_size = sizeof material;
      REQUIRE(relit_material(player, mesh.material, &material) == RELIT_OK);
      opaque &= material.alpha_mode == 0 && mesh.colors == nullptr;
      std::vector<float> positions(std::size_t{3} * mesh.vertex_count);
      REQUIRE(relit_posed_vertices(player, m, positions.data(), nullptr, mesh.vertex_count) ==
              RELIT_OK);
      std::int32_t width = 1, height = 1;
      std::vector<std::uint8_t> rgba(4, 255);
      if (material.image >= 0) {
        const auto image = static_cast<std::uint32_t>(material.image);
        REQUIRE(relit_image(player, image, &width, &height, nullptr, 0) == RELIT_OK);
        rgba.resize(std::size_t{4} * static_cast<std::size_t>(width * height));
        REQUIRE(relit_image(player, image, &width, &height, rgba.data(), rgba.size()) == RELIT_OK);
      }
      gl.ActiveTexture(GL_TEXTURE1);
      textures.push_back(gles::make_texture(
          device, {GL_RGBA, GL_RGBA, GL_UNSIGNED_BYTE, GL_LINEAR, 4}, width, height, rgba.data()));
      gl.ActiveTexture(GL_TEXTURE0);
      gl.Uniform4f(gl.GetUniformLocation(name, "u_base"), material.base_color[0],
                   material.base_color[1], material.base_color[2], material.base_color[3]);
      bind(GL_ARRAY_BUFFER, positions.data(), positions.size() * sizeof(float));
      gl.VertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
      bind(GL_ARRAY_BUFFER, mesh.lightmap_uv, 2 * sizeof(float) * mesh.vertex_count);
      gl.VertexAttribPointer(1, 2, GL_FLOAT, GL_FALSE, 0, nullptr);
      bind(GL_ARRAY_BUFFER, mesh.albedo_uv != nullptr ? mesh.albedo_uv : mesh.lightmap_uv,
           2 * sizeof(float) * mesh.vertex_count);
      gl.VertexAttribPointer(2, 2, GL_FLOAT, GL_FALSE, 0, nullptr);
      for (GLuint i = 0; i < 3; ++i) gl.EnableVertexAttribArray(i);
      bind(GL_ELEMENT_ARRAY_BUFFER, mesh.indices, sizeof(std::uint16_t) * mesh.index_count);
      gl.DrawElements(GL_TRIANGLES, static_cast<GLsizei>(mesh.index_count), GL_UNSIGNED_SHORT,
                      nullptr);
    }
    REQUIRE(opaque);
    for (GLuint i = 0; i < 3; ++i) gl.DisableVertexAttribArray(i);
    const Picture by_host = read_back(framebuffer);
    gl.Disable(GL_DEPTH_TEST);
    gl.Disable(GL_CULL_FACE);
    gl.UseProgram(0);
    const Difference difference = compare(expected, by_host);
    CHECK(difference.covered > 1000);
    // The same light, vertices and coverage. This shader takes no mipmaps of the albedo and does
    // not dither, so single texels of wood grain differ, but not on the mean.
    CHECK(difference.mean < 1);
  });
}

TEST_CASE("api: with the background kept, the host's picture and depth stay") {
  on_contexts([](ApiContext& context, gles::Device& device) {
    const Attached attached(context, RELIT_PATH_CPU);
    relit_view view = view_for(attached.player);
    const Picture alone = draw(attached, device, view);
    view.background = RELIT_BACKGROUND_KEEP;
    const gles::Functions& gl = device.gl();
    for (const float depth : {1.0f, 0.0f}) {
      gles::Framebuffer framebuffer = make_framebuffer(device);
      framebuffer.bind();
      gl.ClearColor(0, 0, 1, 1);
      gl.ClearDepthf(depth);
      gl.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
      gl.ClearDepthf(1);
      REQUIRE(relit_draw(attached.player, &view) == RELIT_OK);
      const Picture picture = read_back(framebuffer);
      std::size_t wrong = 0;
      for (std::size_t i = 0; i < picture.size(); i += 4) {
        const bool seen = depth == 1 && alone[i + 3] == 255;
        const Picture blue{0, 0, 255, 255};
        const std::uint8_t* expected = seen ? alone.data() + i : blue.data();
        wrong += std::memcmp(expected, picture.data() + i, 4) != 0 ? 1 : 0;
      }
      // Pixels on the edge are covered or not, never in between, without multisampling.
      CHECK(wrong == 0);
    }
  });
}

TEST_CASE("api: contexts come and go, and are lost") {
  on_contexts([](ApiContext& context, gles::Device& device) {
    const Attached attached(context, RELIT_PATH_AUTO);
    relit_player* player = attached.player;
    relit_view view = view_for(player);
    const Picture first = draw(attached, device, view);
    const relit_gl_options gl = context.options();
    CHECK(relit_gl_attach(player, &gl) == RELIT_INVALID);
    CHECK(relit_adopt(player) == RELIT_INVALID);
    CHECK(relit_gl_detach(player) == RELIT_OK);
    CHECK(relit_draw(player, &view) == RELIT_INVALID);
    waited(player);  // goes on headless
    CHECK(light_map(player).size() > 0);
    REQUIRE(relit_gl_attach(player, &gl) == RELIT_OK);
    waited(player);
    CHECK(compare(first, draw(attached, device, view)).most <= 3);
    CHECK(relit_gl_abandon(player) == RELIT_OK);
    REQUIRE(relit_gl_attach(player, &gl) == RELIT_OK);
    waited(player);
    CHECK(compare(first, draw(attached, device, view)).most <= 3);

    context.context->release_current();
    CHECK(relit_draw(player, &view) == RELIT_ENVIRONMENT);
    CHECK(attached.player.error().find("current") != std::string::npos);
    CHECK(relit_gl_detach(player) == RELIT_ENVIRONMENT);
    const ApiPlayer other(mannequin());
    CHECK(relit_gl_attach(other, &gl) == RELIT_ENVIRONMENT);
    REQUIRE(context.context->make_current());
    CHECK(compare(first, draw(attached, device, view)).most <= 3);
    relit_gl_options none = gl;
    none.get_proc_address = nullptr;
    CHECK(relit_gl_attach(other, &none) == RELIT_INVALID);
    none.get_proc_address = [](void*, const char*) -> void* { return nullptr; };
    CHECK(relit_gl_attach(other, &none) == RELIT_ENVIRONMENT);
    none = gl;
    none.es_version = 4;
    CHECK(relit_gl_attach(other, &none) == RELIT_INVALID);
    none.struct_size = 1;
    CHECK(relit_gl_attach(other, &none) == RELIT_INVALID);
    CHECK(relit_gl_attach(other, nullptr) == RELIT_INVALID);
    // Closing without the context forgets its objects.
    REQUIRE(relit_gl_attach(other, &gl) == RELIT_OK);
    context.context->release_current();
    relit_close(other.handle);
    const_cast<ApiPlayer&>(other).handle = nullptr;
    REQUIRE(context.context->make_current());
  });
}

TEST_CASE("api: views that make no sense are refused, extreme ones drawn") {
  on_contexts([](ApiContext& context, gles::Device& device) {
    const Attached attached(context, RELIT_PATH_CPU);
    gles::Framebuffer framebuffer = make_framebuffer(device);
    framebuffer.bind();
    const relit_view good = view_for(attached.player);
    const auto refused = [&](auto&& change) {
      relit_view view = good;
      change(view);
      CHECK(relit_draw(attached.player, &view) == RELIT_INVALID);
    };
    refused([](relit_view& v) { v.view[5] = NAN; });
    refused([](relit_view& v) { v.projection[0] = INFINITY; });
    refused([](relit_view& v) { v.exposure = -1; });
    refused([](relit_view& v) { v.exposure = NAN; });
    refused([](relit_view& v) { v.width = 0; });
    refused([](relit_view& v) { v.tone_map = 3; });
    refused([](relit_view& v) { v.background = 4; });
    refused([](relit_view& v) { v.background_color[1] = NAN; });
    refused([](relit_view& v) { v.background_blur_rad = -1; });
    refused([](relit_view& v) { v.struct_size = 0; });
    CHECK(relit_draw(attached.player, nullptr) == RELIT_INVALID);
    float light[3] = {1e30f, 1e30f, 1e30f};
    REQUIRE(relit_set_light_sh(attached.player, light, 1) == RELIT_OK);
    waited(attached.player);
    CHECK(relit_draw(attached.player, &good) == RELIT_OK);
    refused([](relit_view& v) { v.exposure = 1e30f; });
    for (const relit_background background :
         {RELIT_BACKGROUND_KEEP, RELIT_BACKGROUND_COLOR, RELIT_BACKGROUND_LIGHT}) {
      relit_view view = good;
      view.background = background;
      CHECK(relit_draw(attached.player, &view) == RELIT_OK);
    }
  });
}
