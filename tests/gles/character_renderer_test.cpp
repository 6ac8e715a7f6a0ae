// SPDX-License-Identifier: MIT
#include "gles/character_renderer.hpp"

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>
#include <memory>

#include "gles/compositor.hpp"
#include "tests/gles/backends.hpp"
#include "tests/gles/drawing.hpp"
#include "tests/results.hpp"
#include "tests/test.hpp"

namespace {

using namespace relit;
using namespace relit::gles;
using namespace relit::test;

constexpr int kSide = 32;

// A renderer, a light map and a picture of kSide² without antialiasing, unless asked for.
struct Stage {
  explicit Stage(const Device& d, int samples = 1, int light_side = 4)
      : device(d),
        uploader(take(LightMapUploader::create(d, light_side, light_side))),
        framebuffer(take(Framebuffer::create(d, {kSide, kSide, samples}))),
        renderer(take(CharacterRenderer::create(d))) {
    light(constant_light(light_side, light_side, {1, 1, 1}), 1);
  }

  void light(const std::vector<float>& values, float magnitude) {
    map = take(uploader.upload(values, magnitude));
  }
  void materials(std::vector<MaterialView> list, std::vector<ImageView> images = {}) {
    require(renderer->set_materials(images, list));
  }
  void meshes(const std::vector<const Quad*>& quads) {
    std::vector<MeshView> views;
    for (std::uint32_t i = 0; i < quads.size(); ++i) views.push_back(quads[i]->view(i));
    require(renderer->set_meshes(views));
    for (std::size_t i = 0; i < quads.size(); ++i)
      require(renderer->update_positions(i, quads[i]->positions));
  }
  Picture draw(View view = {}) {
    view.width = framebuffer.draw_width();
    view.height = framebuffer.draw_height();
    framebuffer.bind();
    require(renderer->draw(view, map));
    require(framebuffer.resolve());
    Picture picture{kSide, kSide, std::vector<std::uint8_t>(4 * kSide * kSide)};
    require(framebuffer.read_back(picture.rgba));
    device.gl().BindFramebuffer(GL_FRAMEBUFFER, 0);
    return picture;
  }

  const Device& device;
  LightMapUploader uploader;
  Framebuffer framebuffer;
  std::unique_ptr<CharacterRenderer> renderer;
  LightMap map;
};

// Dithering moves a value by half a step before rounding by another half: 1. On ES 3 the sampler
// decodes sRGB, which may cost half a step more (llvmpipe's polynomial takes 0.44). Mediump adds
// 2^-11 per rounding, and the curve's slope (at most 1 above 0.2, in display values) times some
// eight of them: 1.
double tolerance(const Device& device) {
  if (device.profile() == Profile::kEs2Mediump) return 2.01;
  return device.is_es3() ? 1.51 : 1.01;
}

std::vector<std::uint8_t> checkerboard(int width, int height) {
  std::vector<std::uint8_t> rgba;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const bool odd = (x + y) % 2 != 0;
      rgba.insert(rgba.end(), {std::uint8_t(odd ? 200 : 40), std::uint8_t(20 * x + 10),
                               std::uint8_t(20 * y + 10), 255});
    }
  return rgba;
}

}  // namespace

TEST_CASE("a lit quad is albedo times light times exposure, in sRGB", "[gles][es2]") {
  const std::vector<std::uint8_t> image{120, 200, 30, 255};
  const Quad quad;
  on_each_backend([&](const Device& device, const Backend&) {
    Stage stage(device);
    MaterialView material;
    material.base_color = {0.9f, 0.5f, 1, 1};
    material.image = 0;
    stage.materials({material}, {{1, 1, image}});
    stage.meshes({&quad});
    const std::array<float, 3> light{0.5f, 0.25f, 1.5f};
    stage.light(constant_light(4, 4, light), 3);
    View view;
    view.exposure = 0.4f;
    const Picture picture = stage.draw(view);
    for (std::size_t c = 0; c < 3; ++c) {
      const double radiance =
          decode_srgb(image[c]) * material.base_color[c] * light[c] * 3 * double{view.exposure};
      double mean = 0;
      for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) {
          CHECK(std::abs(picture.at(x, y)[c] - encode_srgb(radiance)) <= tolerance(device));
          mean += picture.at(x, y)[c];
        }
      // Dithering leaves the mean where it was: 8×8 thresholds, so 1/64 of a step, and mediump's
      // own.
      mean /= kSide * kSide;
      CHECK(std::abs(mean - encode_srgb(radiance)) <= tolerance(device) - 0.98);
    }
    CHECK(picture.at(3, 3)[3] == 255);
  });
}

TEST_CASE("images are loaded once each, in order, and only where they are shown", "[gles]") {
  const std::vector<std::uint8_t> red{255, 0, 0, 255}, green{0, 255, 0, 255};
  const Quad quad;
  on_each_backend([&](const Device& device, const Backend&) {
    Stage stage(device);
    std::vector<std::size_t> loaded;
    const auto load = [&](std::size_t index) -> std::optional<ImageView> {
      loaded.push_back(index);
      if (index == 3) return std::nullopt;
      return ImageView{1, 1, index == 0 ? red : green};
    };
    std::vector<MaterialView> materials(5);
    materials[0].image = 2;
    materials[1].image = 3;  // cannot be had
    materials[2].image = 0;
    materials[3].image = 2;
    materials[3].wrap_u = Wrap::kMirror;  // another texture of the same image
    require(stage.renderer->set_materials(4, load, materials));
    CHECK(loaded == std::vector<std::size_t>{0, 2, 3});
    // Full light on unit albedo: a channel is all or nothing.
    const auto seen = [&](std::uint32_t material) {
      const MeshView mesh = quad.view(material);
      require(stage.renderer->set_meshes(std::span(&mesh, 1)));
      require(stage.renderer->update_positions(0, quad.positions));
      const auto pixel = stage.draw().at(kSide / 2, kSide / 2);
      return std::array<bool, 3>{pixel[0] > 128, pixel[1] > 128, pixel[2] > 128};
    };
    CHECK(seen(0) == std::array{false, true, false});
    CHECK(seen(1) == std::array{true, true, true});
    CHECK(seen(2) == std::array{true, false, false});
    CHECK(seen(3) == std::array{false, true, false});
    CHECK(seen(4) == std::array{true, true, true});
  });
}

TEST_CASE("the light map's row 0 is v = 0 and negative light is black", "[gles][es2]") {
  // Four texels: red above green on the left, blue above negative on the right.
  std::vector<float> light(3 * 4, 0.0f);
  light[0] = 1;
  light[4 + 2] = 1;
  light[8 + 1] = 1;
  light[3] = light[4 + 3] = light[8 + 3] = -5;
  const Quad quad;
  on_each_backend([&](const Device& device, const Backend&) {
    Stage stage(device, 1, 2);
    stage.materials({MaterialView{}});
    stage.meshes({&quad});
    stage.light(light, 1);
    const Picture picture = stage.draw();
    // In the outer quarter of each texel there is no neighbour to filter with.
    CHECK(picture.at(2, 2) == std::array<int, 4>{255, 0, 0, 255});
    CHECK(picture.at(29, 2) == std::array<int, 4>{0, 0, 255, 255});
    CHECK(picture.at(2, 29) == std::array<int, 4>{0, 255, 0, 255});
    CHECK(picture.at(29, 29) == std::array<int, 4>{0, 0, 0, 255});
    // Filtered first, clamped then: in the middle red is (1 + 0 + 0 - 5)/4.
    CHECK(picture.at(16, 16)[0] == 0);
  });
}

TEST_CASE("vertex colours and base colour tint, in linear light", "[gles][es2]") {
  Quad quad;
  quad.colors.assign(4, {128, 255, 64, 255});
  on_each_backend([&](const Device& device, const Backend&) {
    Stage stage(device);
    stage.materials({MaterialView{}});
    stage.meshes({&quad});
    const std::array<int, 4> pixel = stage.draw().at(10, 20);
    CHECK(std::abs(pixel[0] - encode_srgb(128 / 255.0)) <= tolerance(device));
    CHECK(pixel[1] == 255);
    CHECK(std::abs(pixel[2] - encode_srgb(64 / 255.0)) <= tolerance(device));
  });
}

TEST_CASE("only front faces are drawn, and the nearer one wins", "[gles][es2]") {
  Quad back;  // clockwise seen from the camera
  back.indices = {0, 2, 1, 0, 3, 2};
  const Quad far(1, 1, -0.5f), near(1, 0.5f, 0.5f);
  on_each_backend([&](const Device& device, const Backend&) {
    Stage stage(device);
    MaterialView red, green;
    red.base_color = {1, 0, 0, 1};
    green.base_color = {0, 1, 0, 1};
    stage.materials({red, green});
    stage.meshes({&back});
    CHECK(stage.draw().at(16, 16) == std::array<int, 4>{0, 0, 0, 0});
    // Clip space here is left-handed in depth: +z looks away, so the camera's matrix turns it.
    View view;
    view.projection = glm::scale(glm::mat4(1.0f), glm::vec3(1, 1, -1));
    stage.meshes({&near, &far});
    const Picture picture = stage.draw(view);
    CHECK(picture.at(16, 16) == std::array<int, 4>{255, 0, 0, 255});
    CHECK(picture.at(2, 2) == std::array<int, 4>{0, 255, 0, 255});
  });
}

TEST_CASE("alpha masks cut and alpha blends mix with what is behind", "[gles][es2]") {
  // Left texel transparent, right one half opaque (128/255).
  const std::vector<std::uint8_t> image{255, 255, 255, 0, 255, 255, 255, 128};
  const Quad far(1, 1, -0.5f), near(1, 1, 0.5f);
  on_each_backend([&](const Device& device, const Backend&) {
    Stage stage(device);
    MaterialView behind, front;
    behind.base_color = {0, 0, 1, 1};
    front.image = 0;
    front.linear_filter = false;
    front.alpha_mode = AlphaMode::kMask;
    View view;
    view.projection = glm::scale(glm::mat4(1.0f), glm::vec3(1, 1, -1));
    stage.materials({front, behind}, {{2, 1, image}});
    stage.meshes({&near, &far});
    Picture picture = stage.draw(view);
    CHECK(picture.at(5, 16) == std::array<int, 4>{0, 0, 255, 255});
    CHECK(picture.at(27, 16) == std::array<int, 4>{255, 255, 255, 255});

    front.alpha_mode = AlphaMode::kBlend;
    stage.materials({front, behind}, {{2, 1, image}});
    stage.meshes({&near, &far});
    picture = stage.draw(view);
    CHECK(picture.at(5, 16)[0] <= 1);
    // White at alpha 128/255 over blue, of display values; dither and rounding, each once more.
    CHECK(std::abs(picture.at(27, 16)[0] - 128) <= 2);
    CHECK(std::abs(picture.at(27, 16)[2] - 255) <= 2);
    CHECK(picture.at(27, 16)[3] == 255);
  });
}

TEST_CASE("blended meshes are drawn from far to near", "[gles][es2]") {
  const Quad far(1, 1, -0.5f), near(1, 1, 0.5f);
  on_each_backend([&](const Device& device, const Backend&) {
    Stage stage(device);
    MaterialView red, green;
    red.base_color = {1, 0, 0, 0.75f};
    green.base_color = {0, 1, 0, 0.75f};
    red.alpha_mode = green.alpha_mode = AlphaMode::kBlend;
    stage.materials({red, green});
    View view;
    view.projection = glm::scale(glm::mat4(1.0f), glm::vec3(1, 1, -1));
    stage.meshes({&near, &far});
    const std::array<int, 4> red_in_front = stage.draw(view).at(16, 16);
    CHECK(red_in_front[0] > red_in_front[1]);
    stage.meshes({&far, &near});
    const std::array<int, 4> green_in_front = stage.draw(view).at(16, 16);
    CHECK(green_in_front[1] > green_in_front[0]);
  });
}

TEST_CASE("images of any size repeat, mirror and clamp, with and without NPOT support",
          "[gles][es2]") {
  // Seen at one pixel a texel where nothing is filtered: 32 pixels over 32/w repeats.
  struct Size {
    int width, height;
  };
  for (const char* ignored : {"", "GL_OES_texture_npot"}) {
    for (const Size size : {Size{8, 8}, Size{5, 3}}) {
      const std::vector<std::uint8_t> image = checkerboard(size.width, size.height);
      Quad quad;
      for (glm::vec2& uv : quad.albedo_uv)
        uv *= glm::vec2(32.0f / float(size.width), 32.0f / float(size.height));
      on_each_backend(
          [&](const Device& device, const Backend&) {
            // fract() of a half float of up to 11 repeats keeps 2^-8: not the edges of texels.
            if (device.profile() == Profile::kEs2Mediump && !device.caps().npot_repeat) return;
            INFO(size.width << "x" << size.height << " ignoring \"" << ignored << '"');
            Stage stage(device);
            for (const Wrap wrap : {Wrap::kRepeat, Wrap::kMirror, Wrap::kClamp}) {
              MaterialView material;
              material.image = 0;
              material.linear_filter = false;
              material.wrap_u = material.wrap_v = wrap;
              stage.materials({material}, {{size.width, size.height, image}});
              stage.meshes({&quad});
              const Picture picture = stage.draw();
              auto texel = [&](int i, int n) {
                if (wrap == Wrap::kClamp) return std::min(i, n - 1);
                if (wrap == Wrap::kRepeat) return i % n;
                return i / n % 2 == 0 ? i % n : n - 1 - i % n;
              };
              int wrong = 0;
              for (int y = 0; y < kSide; ++y)
                for (int x = 0; x < kSide; ++x) {
                  const int at = texel(y, size.height) * size.width + texel(x, size.width);
                  for (std::size_t c = 0; c < 3; ++c)
                    wrong +=
                        std::abs(picture.at(x, y)[c] -
                                 image[4 * static_cast<std::size_t>(at) + c]) > tolerance(device);
                }
              CHECK(wrong == 0);
            }
          },
          {ignored, false});
    }
  }
}

TEST_CASE("a filtered NPOT image repeats on strict ES 2 as it does elsewhere", "[gles][es2]") {
  // A smooth image: one period of a cosine, so that enlarging it to a power of two changes little.
  constexpr int kWidth = 24;
  std::vector<std::uint8_t> image;
  for (int x = 0; x < kWidth; ++x) {
    const auto v =
        static_cast<std::uint8_t>(128 + 100 * std::cos(2 * 3.14159265 * (x + 0.5) / kWidth) + 0.5);
    image.insert(image.end(), {v, v, v, 255});
  }
  Quad quad(2);
  on_each_backend(
      [&](const Device& device, const Backend&) {
        REQUIRE_FALSE(device.caps().npot_repeat);
        Stage stage(device);
        MaterialView material;
        material.image = 0;
        stage.materials({material}, {{kWidth, 1, image}});
        stage.meshes({&quad});
        const Picture picture = stage.draw();
        for (int x = 0; x < kSide; ++x) {
          const double expected = 128 + 100 * std::cos(2 * 3.14159265 * 2 * (x + 0.5) / kSide);
          // A pixel covers 1.5 texels, a chord of the cosine: 100·(2π/24·1.5)²/8 = 1.9, once for
          // enlarging, once for the mipmap's (at most halved) filter at twice that width (7.7).
          CHECK(std::abs(picture.at(x, 16)[1] - expected) <= 10);
        }
      },
      {"GL_OES_texture_npot", true});
}

TEST_CASE("edges are smoothed by samples", "[gles][es2]") {
  // A triangle whose long edge runs slightly off the vertical.
  Quad quad;
  quad.positions = {{-1, -1, 0}, {0.1f, -1, 0}, {-0.2f, 1, 0}, {-1, 1, 0}};
  on_each_backend([&](const Device& device, const Backend&) {
    for (const int samples : {1, 4, 16}) {
      Stage stage(device, samples);
      stage.materials({MaterialView{}});
      stage.meshes({&quad});
      const Picture picture = stage.draw();
      std::vector<int> levels;
      for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) levels.push_back(picture.at(x, y)[1]);
      std::sort(levels.begin(), levels.end());
      const auto distinct = std::unique(levels.begin(), levels.end()) - levels.begin();
      INFO("samples " << samples << ": " << distinct << " levels");
      CHECK((samples == 1 ? distinct == 2 : distinct >= 4));
    }
  });
}

TEST_CASE("tone curves keep black and order, and end at white", "[gles][es2]") {
  Quad quad;
  on_each_backend([&](const Device& device, const Backend&) {
    Stage stage(device);
    stage.materials({MaterialView{}});
    stage.meshes({&quad});
    for (const ToneMap tone_map : {ToneMap::kLinear, ToneMap::kFilmic, ToneMap::kNeutral}) {
      int last = -1;
      for (const float exposure : {0.0f, 0.05f, 0.18f, 0.5f, 1.0f, 4.0f, 50.0f, 1e6f}) {
        View view;
        view.exposure = exposure;
        view.tone_map = tone_map;
        const int value = stage.draw(view).at(16, 16)[1];
        CHECK(value >= last);
        if (exposure == 0) CHECK(value == 0);
        last = value;
      }
      CHECK(last >= 254);
    }
    // Narkowicz's curve at 0.5: 0.5·(2.51·0.5 + 0.03) / (0.5·(2.43·0.5 + 0.59) + 0.14) = 0.6163.
    View view;
    view.exposure = 0.5f;
    view.tone_map = ToneMap::kFilmic;
    CHECK(std::abs(stage.draw(view).at(16, 16)[1] - encode_srgb(0.6163)) <= tolerance(device));
    // Khronos PBR Neutral below its shoulder: grey 0.5 less 0.04.
    view.tone_map = ToneMap::kNeutral;
    CHECK(std::abs(stage.draw(view).at(16, 16)[1] - encode_srgb(0.46)) <= tolerance(device));
  });
}

TEST_CASE("a view draws only within its rectangle, and state is put back", "[gles][es2]") {
  Quad quad;
  on_each_backend([&](const Device& device, const Backend&) {
    Stage stage(device);
    Background white;
    white.kind = Background::Kind::kColor;
    white.top = {1, 1, 1};
    require(stage.renderer->background().set(white));
    stage.materials({MaterialView{}});
    stage.meshes({&quad});
    stage.light(constant_light(4, 4, {1, 0, 0}), 1);
    const Functions& gl = device.gl();
    stage.framebuffer.bind();
    gl.ClearColor(0, 0, 0, 1);
    gl.Clear(GL_COLOR_BUFFER_BIT);
    gl.Viewport(1, 2, 3, 4);
    GLint before = 0;
    gl.GetIntegerv(GL_FRAMEBUFFER_BINDING, &before);
    View view;
    view.x = 8;
    view.y = 4;
    view.width = 16;
    view.height = 8;
    require(stage.renderer->draw(view, stage.map));
    GLint after = 0;
    GLint viewport[4] = {};
    gl.GetIntegerv(GL_FRAMEBUFFER_BINDING, &after);
    gl.GetIntegerv(GL_VIEWPORT, viewport);
    CHECK(after == before);
    CHECK(viewport[0] == 1);
    CHECK(viewport[3] == 4);
    constexpr GLenum kBindings[] = {GL_CURRENT_PROGRAM, GL_ARRAY_BUFFER_BINDING,
                                    GL_TEXTURE_BINDING_2D, GL_ELEMENT_ARRAY_BUFFER_BINDING};
    for (const GLenum name : kBindings) {
      GLint bound = -1;
      gl.GetIntegerv(name, &bound);
      CHECK(bound == 0);
    }
    constexpr GLenum kSwitches[] = {GL_BLEND, GL_DEPTH_TEST, GL_CULL_FACE, GL_SCISSOR_TEST};
    for (const GLenum name : kSwitches) CHECK(gl.IsEnabled(name) == GLboolean{GL_FALSE});
    require(stage.framebuffer.resolve());
    Picture picture{kSide, kSide, std::vector<std::uint8_t>(4 * kSide * kSide)};
    require(stage.framebuffer.read_back(picture.rgba));
    int red = 0, black = 0;
    for (int i = 0; i < kSide * kSide; ++i) {
      const std::array<int, 4> p = picture.at(i % kSide, i / kSide);
      red += p == std::array<int, 4>{255, 0, 0, 255};
      black += p == std::array<int, 4>{0, 0, 0, 255};
    }
    CHECK(red == 16 * 8);
    CHECK(black == kSide * kSide - 16 * 8);
    // GL counts rows from the bottom, pictures from the top.
    CHECK(picture.at(8, kSide - 1 - 4)[0] == 255);
  });
}

TEST_CASE("a light map from the GPU is drawn as its composite", "[gles][es2]") {
  // One plane of 8 bits: value = (m - 128)/128, by columns 0.25 and 0.75, twice as high in green.
  std::vector<std::uint8_t> samples(8 * 8);
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = i % 8 < 4 ? 160 : 224;
  PlaneView plane;
  plane.mantissa = {samples.data(), 8, 8, 8, 1};
  plane.scale = 1.0f / 128;
  const Rgb weight{0.25f, 0.5f, 0};
  FoldedLight folded;
  folded.weights = std::span(&weight, 1);
  folded.magnitude = 2;
  const Quad quad;
  for (const LightMapFormat format : {LightMapFormat::kHalfFloat, LightMapFormat::kSquareRoot8}) {
    on_each_backend([&](const Device& device, const Backend&) {
      PlaneSetDescription description;
      description.width = description.height = 8;
      description.planes.resize(1);
      description.format = format;
      auto compositor = take(Compositor::create(device, description));
      require(compositor->upload(std::span(&plane, 1)));
      Stage stage(device);
      stage.map = take(compositor->composite(folded));
      stage.materials({MaterialView{}});
      stage.meshes({&quad});
      const Picture picture = stage.draw();
      // Square roots are dithered by a step of 1/255 in the root: 2·√v·√peak/255, which the sRGB
      // curve (slope below 1.7 in this range) and 255 levels make at most 5.
      const double slack = format == LightMapFormat::kHalfFloat ? tolerance(device) : 6;
      CHECK(std::abs(picture.at(4, 9)[0] - encode_srgb(0.25 * 0.25 * 2)) <= slack);
      CHECK(std::abs(picture.at(4, 9)[1] - encode_srgb(0.25 * 0.5 * 2)) <= slack);
      CHECK(std::abs(picture.at(28, 9)[0] - encode_srgb(0.75 * 0.25 * 2)) <= slack);
      CHECK(std::abs(picture.at(28, 9)[1] - encode_srgb(0.75 * 0.5 * 2)) <= slack);
      CHECK(picture.at(28, 9)[2] == 0);
    });
  }
}

TEST_CASE("the renderer refuses meshes, materials and views that make no sense", "[gles][es2]") {
  on_each_backend([&](const Device& device, const Backend&) {
    Stage stage(device);
    Quad quad;
    MeshView mesh = quad.view();
    mesh.indices = std::span(quad.indices).first(4);
    CHECK(stage.renderer->set_meshes(std::span(&mesh, 1)).error().code == ErrorCode::kInvalid);
    quad.indices[1] = 4;
    mesh = quad.view();
    CHECK_FALSE(stage.renderer->set_meshes(std::span(&mesh, 1)));
    quad.indices[1] = 1;
    quad.uv[2].x = NAN;
    mesh = quad.view();
    CHECK_FALSE(stage.renderer->set_meshes(std::span(&mesh, 1)));
    quad = Quad();
    mesh = quad.view();
    mesh.vertex_count = 0;
    CHECK(stage.renderer->set_meshes(std::span(&mesh, 1)).error().code == ErrorCode::kLimit);

    MaterialView material;
    material.image = 0;
    CHECK_FALSE(stage.renderer->set_materials({}, std::span(&material, 1)));
    const std::vector<std::uint8_t> texels(15);
    const ImageView image{2, 2, texels};
    CHECK_FALSE(stage.renderer->set_materials(std::span(&image, 1), std::span(&material, 1)));

    mesh = quad.view(7);
    REQUIRE(stage.renderer->set_meshes(std::span(&mesh, 1)));
    CHECK_FALSE(stage.renderer->update_positions(0, std::span(quad.positions).first(3)));
    CHECK_FALSE(stage.renderer->update_positions(1, quad.positions));
    View view;
    view.width = view.height = 8;
    stage.framebuffer.bind();
    CHECK_FALSE(stage.renderer->draw(view, stage.map));  // no material 7
    mesh = quad.view(0);
    REQUIRE(stage.renderer->set_meshes(std::span(&mesh, 1)));
    material.image = -1;
    REQUIRE(stage.renderer->set_materials({}, std::span(&material, 1)));
    CHECK(stage.renderer->draw(view, stage.map));
    view.exposure = INFINITY;
    CHECK_FALSE(stage.renderer->draw(view, stage.map));
    view.exposure = 1;
    view.view[2][1] = NAN;
    CHECK_FALSE(stage.renderer->draw(view, stage.map));
    device.gl().BindFramebuffer(GL_FRAMEBUFFER, 0);
  });
}
