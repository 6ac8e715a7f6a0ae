// SPDX-License-Identifier: MIT
#include "gles/background.hpp"

#include <glm/gtc/matrix_transform.hpp>

#include "tests/gles/backends.hpp"
#include "tests/gles/drawing.hpp"
#include "tests/test.hpp"

namespace {

using namespace relit;
using namespace relit::gles;
using namespace relit::test;

constexpr int kSide = 33;

// What a camera at the origin that looks along `forward` sees: kSide² pixels over 60°.
Picture look(const Device& device, BackgroundRenderer& background, const glm::vec3& forward,
             View view = {}) {
  auto framebuffer = Framebuffer::create(device, {kSide, kSide, 1});
  REQUIRE(framebuffer);
  const glm::vec3 up = std::abs(forward.y) > 0.9f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
  // A translation must not matter.
  view.view = glm::lookAt(glm::vec3(3, 4, 5), glm::vec3(3, 4, 5) + forward, up);
  view.projection = glm::perspective(glm::radians(60.0f), 1.0f, 0.1f, 100.0f);
  view.width = view.height = kSide;
  framebuffer->bind();
  {
    StateGuard guard(device);
    device.gl().Viewport(0, 0, kSide, kSide);
    REQUIRE(background.draw(view));
  }
  Picture picture{kSide, kSide, std::vector<std::uint8_t>(4 * kSide * kSide)};
  REQUIRE(framebuffer->read_back(picture.rgba));
  device.gl().BindFramebuffer(GL_FRAMEBUFFER, 0);
  return picture;
}

// 64×32 of radiance 0.02 with a white patch of 5×5 pixels around (x, y).
std::vector<float> patch(int x, int y) {
  std::vector<float> rgb(3 * 64 * 32, 0.02f);
  for (int j = std::max(0, y - 2); j <= std::min(31, y + 2); ++j)
    for (int i = x - 2; i <= x + 2; ++i)
      for (int c = 0; c < 3; ++c)
        rgb[static_cast<std::size_t>(3 * (j * 64 + (i + 64) % 64) + c)] = 1;
  return rgb;
}

}  // namespace

TEST_CASE("an environment is seen where the light comes from", "[gles][es2]") {
  // Azimuth φ = 2π(x+½)/64 from +x towards +z, elevation from row 0 at +y.
  struct Direction {
    int x, y;
  };
  for (const Direction at :
       {Direction{0, 15}, Direction{16, 15}, Direction{40, 8}, Direction{63, 24}}) {
    const float phi = 2 * 3.14159265f * (static_cast<float>(at.x) + 0.5f) / 64;
    const float theta = 3.14159265f * (static_cast<float>(at.y) + 0.5f) / 32;
    const glm::vec3 direction(std::sin(theta) * std::cos(phi), std::cos(theta),
                              std::sin(theta) * std::sin(phi));
    const std::vector<float> rgb = patch(at.x, at.y);
    on_each_backend([&](const Device& device, const Backend&) {
      auto background = BackgroundRenderer::create(device);
      REQUIRE(background);
      Background b;
      b.kind = Background::Kind::kEnvironment;
      b.environment = {64, 32, rgb};
      REQUIRE(background->set(b));
      CHECK(look(device, *background, direction).at(kSide / 2, kSide / 2)[1] >= 250);
      CHECK(look(device, *background, -direction).at(kSide / 2, kSide / 2)[1] < 60);
      // Turning the light by 90° takes the patch from φ to φ + 90°.
      const float turned = phi + 3.14159265f / 2;
      const glm::vec3 there(std::sin(theta) * std::cos(turned), std::cos(theta),
                            std::sin(theta) * std::sin(turned));
      background->set_rotation(3.14159265f / 2);
      CHECK(look(device, *background, direction).at(kSide / 2, kSide / 2)[1] < 60);
      CHECK(look(device, *background, there).at(kSide / 2, kSide / 2)[1] >= 250);
    });
  }
}

TEST_CASE("an environment is the right way up and not mirrored", "[gles][es2]") {
  // Looking along -z, +x is to the right and +y up: red grows to +x, green to +y, in linear steps.
  std::vector<float> rgb;
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 64; ++x) {
      const double phi = 2 * 3.14159265 * (x + 0.5) / 64, theta = 3.14159265 * (y + 0.5) / 32;
      rgb.push_back(static_cast<float>(0.5 + 0.5 * std::sin(theta) * std::cos(phi)));
      rgb.push_back(static_cast<float>(0.5 + 0.5 * std::cos(theta)));
      rgb.push_back(static_cast<float>(0.5 + 0.5 * std::sin(theta) * std::sin(phi)));
    }
  on_each_backend([&](const Device& device, const Backend&) {
    auto background = BackgroundRenderer::create(device);
    REQUIRE(background);
    Background b;
    b.kind = Background::Kind::kEnvironment;
    b.environment = {64, 32, rgb};
    REQUIRE(background->set(b));
    const Picture picture = look(device, *background, {0, 0, -1});
    const float half = std::tan(glm::radians(30.0f));
    for (int y = 0; y < kSide; y += 4)
      for (int x = 0; x < kSide; x += 4) {
        const glm::vec3 d = glm::normalize(
            glm::vec3(half * (2 * (static_cast<float>(x) + 0.5f) / kSide - 1),
                      half * (1 - 2 * (static_cast<float>(y) + 0.5f) / kSide), -1.0f));
        // A cube map of 16² shifts a direction by up to half a texel, 1/16 rad (see CubeMap), so
        // the values by up to 0.5/16 = 0.031; the curve's slope at 0.3 and more is below 1: 8 of
        // 255.
        CHECK(std::abs(picture.at(x, y)[0] - encode_srgb(0.5 + 0.5 * d.x)) <= 8);
        CHECK(std::abs(picture.at(x, y)[1] - encode_srgb(0.5 + 0.5 * d.y)) <= 8);
        if (d.z > -0.9f) CHECK(std::abs(picture.at(x, y)[2] - encode_srgb(0.5 + 0.5 * d.z)) <= 16);
      }
  });
}

TEST_CASE("an environment has no seams, at its edges nor the cube's", "[gles][es2]") {
  std::vector<float> rgb;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 128; ++x) {
      const double phi = 2 * 3.14159265 * (x + 0.5) / 128, theta = 3.14159265 * (y + 0.5) / 64;
      for (int c = 0; c < 3; ++c)
        rgb.push_back(static_cast<float>(0.4 + 0.2 * std::sin(theta) * std::cos(phi + c) +
                                         0.1 * std::cos(2 * theta)));
    }
  on_each_backend([&](const Device& device, const Backend&) {
    auto background = BackgroundRenderer::create(device);
    REQUIRE(background);
    Background b;
    b.kind = Background::Kind::kEnvironment;
    b.environment = {128, 64, rgb};
    REQUIRE(background->set(b));
    for (const glm::vec3 forward : {glm::vec3(1, 0, 0), glm::vec3(1, 1, 1) * 0.57735f,
                                    glm::vec3(0, -1, 0), glm::vec3(-0.6f, 0, 0.8f)}) {
      const Picture picture = look(device, *background, forward);
      int steepest = 0;
      for (int y = 0; y < kSide; ++y)
        for (int x = 1; x < kSide; ++x)
          steepest = std::max(steepest, std::abs(picture.at(x, y)[1] - picture.at(x - 1, y)[1]));
      // A pixel is 60°/33 = 0.032 rad at most; the gradient at most 0.4 per radian, the curve's
      // slope 1.4 there: 4.5 of 255, twice where the cube map stretches unevenly, and dither.
      CHECK(steepest <= 10);
    }
  });
}

TEST_CASE("harmonics show the radiance they describe", "[gles][es2]") {
  // L_0 = √(4π) is radiance 1; 0.3·y in green by Y_1 = 0.488603·y; ring-negative blue is black.
  std::vector<std::array<float, 3>> sh(4);
  sh[0] = {3.5449077f, 0.5f * 3.5449077f, 0};
  sh[1] = {0, 0.3f / 0.488603f, 0};
  sh[3] = {-0.5f / 0.488603f, 0, 0.2f / 0.488603f};
  on_each_backend([&](const Device& device, const Backend&) {
    auto background = BackgroundRenderer::create(device);
    REQUIRE(background);
    Background b;
    b.kind = Background::Kind::kHarmonics;
    b.harmonics = sh;
    REQUIRE(background->set(b));
    View view;
    view.exposure = 0.5f;
    // Half floats or shared roots keep about 1 %; the curve's slope is below 1: 3 of 255.
    auto near = [](int value, double radiance) {
      return std::abs(value - encode_srgb(radiance)) <= 3;
    };
    std::array<int, 4> pixel = look(device, *background, {0, 1, 0}, view).at(16, 16);
    CHECK(near(pixel[0], 0.5));
    CHECK(near(pixel[1], 0.4));
    pixel = look(device, *background, {1, 0, 0}, view).at(16, 16);
    CHECK(near(pixel[0], 0.25));
    CHECK(near(pixel[2], 0.1));
    pixel = look(device, *background, {-1, 0, 0}, view).at(16, 16);
    CHECK(near(pixel[0], 0.75));
    CHECK(pixel[2] <= 1);
    pixel = look(device, *background, {0, -1, 0}, view).at(16, 16);
    CHECK(near(pixel[1], 0.1));
  });
}

TEST_CASE("environments keep their range without half floats", "[gles][es2]") {
  // Radiance 0.02 beside 1, in 8-bit textures.
  const std::vector<float> rgb = patch(0, 15);
  on_each_backend(
      [&](const Device& device, const Backend&) {
        auto background = BackgroundRenderer::create(device);
        REQUIRE(background);
        Background b;
        b.kind = Background::Kind::kEnvironment;
        b.environment = {64, 32, rgb};
        REQUIRE(background->set(b));
        View view;
        view.exposure = 5;
        const int dim = look(device, *background, {-1, 0, 0}, view).at(16, 16)[0];
        // The shared multiplier keeps the root to 1/255 of itself: 0.8 % of 0.1, below 1 of 255;
        // mediump and dither add 2.
        CHECK(std::abs(dim - encode_srgb(0.1)) <= 3);
        CHECK(look(device, *background, {1, 0, 0}, view).at(16, 16)[0] >= 254);
      },
      {"GL_OES_texture_half_float", false});
}

TEST_CASE("colours and gradients are shown as they are", "[gles][es2]") {
  on_each_backend([&](const Device& device, const Backend&) {
    auto background = BackgroundRenderer::create(device);
    REQUIRE(background);
    Background b;
    b.kind = Background::Kind::kColor;
    b.top = {1, 0.5f, 0};
    REQUIRE(background->set(b));
    View view;
    view.exposure = 100;
    std::array<int, 4> pixel = look(device, *background, {0, 0, 1}, view).at(4, 9);
    CHECK(pixel[0] == 255);
    CHECK(std::abs(pixel[1] - 127.5) <= 1);
    CHECK(pixel[2] == 0);
    CHECK(pixel[3] == 255);

    b.kind = Background::Kind::kGradient;
    b.top = {0, 0, 1};
    b.bottom = {1, 0, 0};
    REQUIRE(background->set(b));
    const Picture picture = look(device, *background, {0, 0, 1});
    CHECK(picture.at(16, 0)[2] > 245);
    CHECK(picture.at(16, kSide - 1)[0] > 245);
    CHECK(std::abs(picture.at(16, 16)[0] - 127.5) <= 2);

    b.kind = Background::Kind::kTransparent;
    REQUIRE(background->set(b));
    CHECK(look(device, *background, {0, 0, 1}).at(3, 3) == std::array<int, 4>{0, 0, 0, 0});
  });
}

TEST_CASE("backgrounds that make no sense are refused", "[gles][es2]") {
  on_each_backend([&](const Device& device, const Backend&) {
    auto background = BackgroundRenderer::create(device);
    REQUIRE(background);
    const std::vector<float> rgb(3 * 4 * 2);
    Background b;
    b.kind = Background::Kind::kEnvironment;
    b.environment = {4, 3, rgb};
    CHECK(background->set(b).error().code == ErrorCode::kInvalid);
    b.environment = {4, 2, rgb};
    b.blur_rad = NAN;
    CHECK_FALSE(background->set(b));
    b.blur_rad = 0;
    CHECK(background->set(b));
    b.kind = Background::Kind::kHarmonics;
    CHECK_FALSE(background->set(b));
    b.kind = Background::Kind::kColor;
    b.top = {0, 2, 0};
    CHECK_FALSE(background->set(b));
  });
}
