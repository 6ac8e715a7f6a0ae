// SPDX-License-Identifier: MIT
#include "player/relighter.hpp"

#include <cmath>
#include <cstdio>
#include <deque>
#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "gles/picture.hpp"
#include "tests/gles/backends.hpp"
#include "tests/gles/drawing.hpp"
#include "tests/reference/composite_reference.hpp"
#include "tests/results.hpp"
#include "tests/test.hpp"

namespace relit::player {
namespace {

using decoders::FrameView;
using relit::test::on_each_backend;
using relit::test::require;
using relit::test::take;

constexpr int kWidth = 40, kHeight = 24;

/// An order-1 model in three layers: constant in colour, one plane for each band-1 coefficient in
/// 4:2:0 pictures with exponents, and one faint plane; as decoders leave them, in pictures.
class Clip {
 public:
  explicit Clip(int width = kWidth, int height = kHeight) {
    model_.width = static_cast<std::uint16_t>(width);
    model_.height = static_cast<std::uint16_t>(height);
    model_.order = 1;
    model_.mean.assign(4, {0.01f, 0.02f, 0.03f});
    layers_.resize(3);
    for (std::size_t c = 0; c < 3; ++c) add(layers_[0], 0, c, 0.2f / 128, static_cast<int>(c));
    layers_[1].has_exponents = true;
    layers_[1].exponent_block = 4;
    layers_[1].chroma = container::Chroma::k420;
    for (int k = 0; k < 3; ++k) {
      add(layers_[1], static_cast<std::size_t>(k) + 1, 0, 1.0f, k);
      for (std::uint8_t c = 1; c < 3; ++c)
        layers_[1].planes.back().matrix.push_back(
            {static_cast<std::uint8_t>(k + 1), c, 0.5f * static_cast<float>(c)});
    }
    add(layers_[2], 2, 1, 0.001f / 128, 0);
  }

  /// The same numbers for the same seed.
  FrameView frame(std::uint64_t number, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<PlaneView> planes;
    const int w = model_.width, h = model_.height;
    for (const container::LayerRecord& layer : layers_) {
      std::vector<std::uint8_t>& exponents = pictures_.emplace_back();
      const int ew = (w + 3) / 4, eh = (h + 3) / 4;
      exponents.resize(static_cast<std::size_t>(ew * eh));
      for (std::uint8_t& e : exponents) e = static_cast<std::uint8_t>(124 + random() % 4);
      for (const container::PlaneRecord& record : layer.planes) {
        PlaneView plane;
        plane.mantissa_shift =
            layer.chroma == container::Chroma::k420 && record.component > 0 ? 1 : 0;
        const int pw = (w + plane.mantissa_shift) >> plane.mantissa_shift;
        const int ph = (h + plane.mantissa_shift) >> plane.mantissa_shift;
        std::vector<std::uint8_t>& samples = pictures_.emplace_back();
        samples.resize(static_cast<std::size_t>(pw * ph));
        for (std::uint8_t& s : samples) s = static_cast<std::uint8_t>(random() % 256);
        plane.mantissa = {samples.data(), pw, pw, ph, 1};
        plane.scale = record.scale;
        if (layer.has_exponents) {
          plane.exponent = {exponents.data(), ew, ew, eh, 1};
          plane.exponent_shift = 2;
        }
        planes.push_back(plane);
      }
    }
    return FrameView(number, planes);
  }

  container::ModelRecord model_;
  std::vector<container::LayerRecord> layers_;

 private:
  static void add(container::LayerRecord& layer, std::size_t coefficient, std::size_t channel,
                  float scale, int component) {
    container::PlaneRecord plane;
    plane.component = static_cast<std::uint8_t>(component);
    plane.scale = scale;
    plane.matrix = {
        {static_cast<std::uint8_t>(coefficient), static_cast<std::uint8_t>(channel), 1}};
    layer.bit_depth = 8;
    layer.planes.push_back(plane);
  }
  std::deque<std::vector<std::uint8_t>> pictures_;  // views point into them
};

decoders::Light test_light(double turn = 0) {
  decoders::Light light;
  light.sh = {{2, 1.8, 1.5}, {0.5, 0.2, 0.1}, {0.3, 0.4, 0.5}, {-0.2, 0.1, 0.3}};
  decoders::rotate_light_y(light, turn);
  return light;
}

/// A quad of one joint over three quarters of the map, its corners' normals apart.
decoders::Mesh bent_sheet() {
  decoders::Mesh mesh;
  const glm::vec2 corners[] = {{0.1f, 0.1f}, {0.85f, 0.1f}, {0.85f, 0.9f}, {0.1f, 0.9f}};
  const glm::vec3 normals[] = {
      {0.6f, 0, 0.8f}, {-0.6f, 0, 0.8f}, {0, 0.8f, 0.6f}, {0, -0.6f, 0.8f}};
  for (std::size_t i = 0; i < 4; ++i) {
    mesh.positions.emplace_back(corners[i], 0.0f);
    mesh.normals.push_back(normals[i]);
    mesh.lightmap_uv.push_back(corners[i]);
    mesh.joints.insert(mesh.joints.end(), {0, 0, 0, 0});
    mesh.weights.insert(mesh.weights.end(), {1, 0, 0, 0});
  }
  mesh.influences_per_vertex = 4;
  mesh.indices = {0, 1, 2, 0, 2, 3};
  return mesh;
}

decoders::Pose turned_pose(float angle_rad) {
  decoders::Pose pose;
  pose.palette.push_back(
      glm::mat4x3(glm::rotate(glm::mat4(1), angle_rad, glm::vec3(0.48f, 0.6f, 0.64f))));
  return pose;
}

/// The light map in double precision, [3][H][W].
struct Reference {
  std::vector<double> values;
  std::vector<double> magnitude;
  double peak = 0;
};
Reference reference(const Clip& clip, const FrameView& frame, const decoders::Light& light,
                    std::span<const glm::vec3> normals = {}) {
  decoders::FoldedWeights folded;
  require(decoders::fold_light(clip.model_, clip.layers_, light, folded));
  decoders::CompositeJob job;
  job.planes = frame.planes();
  job.light = folded.view;
  job.light.weights = folded.weights;
  job.width = clip.model_.width, job.height = clip.model_.height;
  job.predictions[0] = {clip.model_.prediction_plane, normals, 1};
  const reference::Composite composite = reference::composite(job);
  Reference out;
  for (std::size_t i = 0; i < composite.value.size(); ++i) {
    const auto scale = static_cast<double>(folded.view.magnitude);
    out.values.push_back(scale * composite.value[i]);
    out.magnitude.push_back(scale * composite.magnitude[i]);
    out.peak = std::max(out.peak, std::abs(out.values.back()));
  }
  return out;
}

/// Relative to the peak. Floats on the CPU: some 20 roundings of 2^-24. On the GPU the target
/// truncates to 2^-10, once a pass, and mediump adds its own (tests/gles/compositor_test.cpp
/// derives and checks both; these are the bounds that the player counts on).
double tolerance(const gles::Device* device, CompositePath path) {
  if (device == nullptr || path == CompositePath::kCpu) return 5e-6;
  return device->profile() == gles::Profile::kEs2Mediump ? 2e-2 : 1.5e-3;
}

double worst_of(Relighter& relighter, const std::vector<double>& expected) {
  std::vector<float> values(expected.size());
  require(relighter.read(values));
  double worst = 0;
  for (std::size_t i = 0; i < values.size(); ++i)
    worst = std::max(worst, std::abs(static_cast<double>(values[i]) - expected[i]));
  return worst;
}

/// On the CPU without a device, and by every path of every backend.
void on_each_path(const Clip& clip,
                  const std::function<void(Relighter&, const gles::Device*)>& body,
                  std::span<const decoders::Mesh> meshes = {}) {
  const auto run = [&](const gles::Device* device, CompositePath path) {
    INFO("path " << composite_path_name(path));
    RelightOptions options{device, path};
    options.meshes = meshes;
    auto relighter = Relighter::create(clip.model_, clip.layers_, options);
    if (path == CompositePath::kFused && !relighter &&
        relighter.error().code == ErrorCode::kUnsupported)
      return;  // mediump
    if (!relighter) FAIL(relighter.error().message);
    REQUIRE((*relighter)->path() == path);
    body(**relighter, device);
  };
  run(nullptr, CompositePath::kCpu);
  on_each_backend([&](const gles::Device& device, const relit::test::Backend&) {
    for (const CompositePath path :
         {CompositePath::kCpu, CompositePath::kTexture, CompositePath::kFused})
      run(&device, path);
  });
}

}  // namespace

TEST_CASE("every path gives the light map of the definition, blended or not") {
  Clip clip;
  const FrameView a = clip.frame(0, 1), b = clip.frame(1, 2);
  const Reference first = reference(clip, a, test_light());
  const Reference second = reference(clip, b, test_light());
  on_each_path(clip, [&](Relighter& relighter, const gles::Device* device) {
    CHECK_FALSE(relighter.composite({&a}));  // no light yet
    require(relighter.set_light(test_light()));
    CHECK_FALSE(relighter.composite({}));
    const double allowed = tolerance(device, relighter.path()) * std::max(first.peak, second.peak);
    for (const float blend : {0.0f, 0.25f, 0.8f, 1.0f}) {
      require(relighter.composite({&a, &b, blend}));
      std::vector<double> expected;
      for (std::size_t i = 0; i < first.values.size(); ++i)
        expected.push_back(
            std::lerp(first.values[i], second.values[i], static_cast<double>(blend)));
      CHECK(worst_of(relighter, expected) <= allowed);
    }
    CHECK_FALSE(relighter.composite({&a, &b, 1.5f}));
    CHECK_FALSE(relighter.composite({&a, &b, std::nanf("")}));
    const FrameView other(0, std::vector<PlaneView>(2));
    CHECK_FALSE(relighter.composite({&other}));
  });
}

TEST_CASE("every path predicts from the normals of the frames' own poses, blended or not") {
  Clip clip;
  clip.model_.prediction_plane = 0;  // which has a weight of its own besides
  const std::vector<decoders::Mesh> meshes{bent_sheet()};
  const decoders::Pose poses[2] = {turned_pose(0.3f), turned_pose(1.4f)};
  auto texels = take(decoders::TexelNormals::create(meshes, kWidth, kHeight));
  std::vector<glm::vec3> normals[2];
  for (int i = 0; i < 2; ++i) {
    normals[i].resize(kWidth * kHeight);
    texels.compute(poses[i], normals[i]);
  }
  const FrameView a = clip.frame(0, 1), b = clip.frame(1, 2);
  const Reference first = reference(clip, a, test_light(), normals[0]);
  const Reference second = reference(clip, b, test_light(), normals[1]);
  CHECK_FALSE(Relighter::create(clip.model_, clip.layers_, {}));  // no meshes
  on_each_path(
      clip,
      [&](Relighter& relighter, const gles::Device* device) {
        require(relighter.set_light(test_light()));
        CHECK_FALSE(relighter.composite({&a}));  // no pose
        CHECK_FALSE(relighter.composite({&a, &b, 0.5f, &poses[0], nullptr}));
        const double allowed =
            tolerance(device, relighter.path()) * std::max(first.peak, second.peak);
        for (const float blend : {0.0f, 0.25f, 0.8f, 1.0f}) {
          require(relighter.composite({&a, &b, blend, &poses[0], &poses[1]}));
          std::vector<double> expected;
          for (std::size_t i = 0; i < first.values.size(); ++i)
            expected.push_back(
                std::lerp(first.values[i], second.values[i], static_cast<double>(blend)));
          CHECK(worst_of(relighter, expected) <= allowed);
        }
        CHECK(relighter.stats().uploads == (relighter.path() == CompositePath::kCpu ? 0 : 2));
        // Without its plane there is no prediction, and no pose is asked for.
        relighter.set_quality({0, false});
        require(relighter.composite({&a}));
      },
      meshes);
}

TEST_CASE("a light map of half the size predicts as its texels do at full size") {
  Clip clip;
  clip.model_.prediction_plane = 0;
  const std::vector<decoders::Mesh> meshes{bent_sheet()};
  const decoders::Pose pose = turned_pose(0.7f);
  auto texels = take(decoders::TexelNormals::create(meshes, kWidth, kHeight));
  std::vector<glm::vec3> normals(kWidth * kHeight);
  texels.compute(pose, normals);
  const FrameView a = clip.frame(0, 1);
  const Reference full = reference(clip, a, test_light(), normals);
  on_each_path(
      clip,
      [&](Relighter& relighter, const gles::Device* device) {
        require(relighter.set_light(test_light()));
        relighter.set_quality({-1, true});
        require(relighter.composite({&a, nullptr, 0, &pose}));
        std::vector<double> expected;
        for (std::size_t c = 0; c < 3; ++c)
          for (std::size_t y = 0; y < kHeight; y += 2)
            for (std::size_t x = 0; x < kWidth; x += 2)
              expected.push_back(full.values[(c * kHeight + y) * kWidth + x]);
        CHECK(worst_of(relighter, expected) <= tolerance(device, relighter.path()) * full.peak);
      },
      meshes);
}

TEST_CASE("each frame is uploaded once while time moves on") {
  Clip clip;
  std::vector<FrameView> frames;
  for (unsigned k = 0; k < 4; ++k) frames.push_back(clip.frame(k, k + 1));
  on_each_path(clip, [&](Relighter& relighter, const gles::Device*) {
    require(relighter.set_light(test_light()));
    for (std::size_t k = 0; k + 1 < frames.size(); ++k) {
      for (const float blend : {0.0f, 0.25f, 0.5f, 0.75f}) {
        require(relighter.composite({&frames[k], &frames[k + 1], blend}));
        require(relighter.composite({&frames[k], &frames[k + 1], blend}));
      }
    }
    const bool on_gpu = relighter.path() != CompositePath::kCpu;
    const RelightStats& stats = relighter.stats();
    CHECK(stats.composites == 12);
    CHECK(stats.skipped == 12);
    CHECK(stats.uploads == (on_gpu ? 4 : 0));
    CHECK(stats.planes_uploaded == (on_gpu ? 4 * 7 : 0));
    CHECK(stats.planes_missing == 0);

    // Where the frame rests, another light composites and uploads nothing.
    require(relighter.set_light(test_light(1)));
    require(relighter.composite({&frames[2], &frames[3], 0.75f}));
    CHECK(relighter.stats().composites == 13);
    CHECK(relighter.stats().uploads == (on_gpu ? 4 : 0));
    const Reference a = reference(clip, frames[2], test_light(1));
    const Reference b = reference(clip, frames[3], test_light(1));
    std::vector<double> expected;
    for (std::size_t i = 0; i < a.values.size(); ++i)
      expected.push_back(std::lerp(a.values[i], b.values[i], 0.75));
    CHECK(worst_of(relighter, expected) <= 2e-2 * a.peak);
    // The same light again is no change, nor is the exposure while it shows everything.
    require(relighter.set_light(test_light(1)));
    relighter.set_exposure(1000);
    require(relighter.composite({&frames[2], &frames[3], 0.75f}));
    CHECK(relighter.stats().composites == 13);
    // What is forgotten is made anew.
    relighter.forget();
    require(relighter.composite({&frames[2]}));
    CHECK(relighter.stats().composites == 14);
    CHECK(relighter.stats().uploads == (on_gpu ? 5 : 0));
  });
}

TEST_CASE("frames are told apart by their numbers and by where their samples lie") {
  Clip clip;
  const FrameView a = clip.frame(7, 1), again = clip.frame(7, 5);
  const FrameView renumbered(8, {a.planes().begin(), a.planes().end()});
  const FrameView same(7, {a.planes().begin(), a.planes().end()});
  auto relighter = take(Relighter::create(clip.model_, clip.layers_, {}));
  require(relighter->set_light(test_light()));
  require(relighter->composite({&a}));
  require(relighter->composite({&same}));
  CHECK(relighter->stats().skipped == 1);
  require(relighter->composite({&again}));
  CHECK(relighter->stats().composites == 2);
  require(relighter->composite({&a}));
  require(relighter->composite({&renumbered}));
  CHECK(relighter->stats().composites == 4);
}

TEST_CASE("planes that the light does not need are not uploaded, and come when it does") {
  Clip clip;
  const FrameView frame = clip.frame(0, 3);
  decoders::Light flat;
  flat.sh = {{2, 1.8, 1.5}};
  on_each_path(clip, [&](Relighter& relighter, const gles::Device* device) {
    const bool on_gpu = relighter.path() != CompositePath::kCpu;
    require(relighter.set_light(flat));
    const auto layers = relighter.needed_layers();
    CHECK(std::vector<std::uint8_t>(layers.begin(), layers.end()) ==
          std::vector<std::uint8_t>{1, 0, 0});
    require(relighter.composite({&frame}));
    CHECK(relighter.stats().planes_uploaded == (on_gpu ? 3 : 0));
    // The faint plane, whose whole range is 0.001 of the light's 0.4, cannot be seen at 1/100.
    require(relighter.set_light(test_light()));
    relighter.set_exposure(0.01f);
    CHECK(relighter.needed_layers()[2] == 0);
    require(relighter.composite({&frame}));
    CHECK(relighter.stats().planes_uploaded == (on_gpu ? 6 : 0));
    relighter.set_exposure(1);
    CHECK(relighter.needed_layers()[2] == 1);
    require(relighter.composite({&frame}));
    CHECK(relighter.stats().planes_uploaded == (on_gpu ? 7 : 0));
    const Reference full = reference(clip, frame, test_light());
    CHECK(worst_of(relighter, full.values) <= tolerance(device, relighter.path()) * full.peak);
    // Layers that were not decoded weigh nothing.
    const std::vector<std::uint8_t> decoded{1, 0, 1};
    require(relighter.set_light(test_light(), decoded));
    CHECK(relighter.needed_layers()[1] == 0);
    // A quality keeps planes from the front.
    require(relighter.set_light(test_light()));
    relighter.set_quality({2, false});
    CHECK(relighter.needed_planes()[1] == 1);
    CHECK(relighter.needed_planes()[2] == 0);
  });
}

TEST_CASE("a layer that has not arrived counts as zero until it does") {
  Clip clip;
  const FrameView whole = clip.frame(5, 4);
  std::vector<PlaneView> planes(whole.planes().begin(), whole.planes().end());
  for (std::size_t k = 3; k < 6; ++k) planes[k] = {};
  const FrameView part(5, planes);
  const std::vector<std::uint8_t> decoded{1, 0, 1};
  on_each_path(clip, [&](Relighter& relighter, const gles::Device* device) {
    const double allowed = tolerance(device, relighter.path());
    require(relighter.set_light(test_light()));
    require(relighter.composite({&part}));
    CHECK(relighter.stats().planes_missing == 3);
    std::vector<float> without(static_cast<std::size_t>(3 * kWidth * kHeight));
    require(relighter.read(without));
    require(relighter.composite({&whole}));
    CHECK(relighter.stats().composites == 2);
    const Reference full = reference(clip, whole, test_light());
    CHECK(worst_of(relighter, full.values) <= allowed * full.peak);
    require(relighter.set_light(test_light(), decoded));
    require(relighter.composite({&whole}));
    CHECK(worst_of(relighter, {without.begin(), without.end()}) <= 2 * allowed * full.peak);
  });
}

TEST_CASE("a light map of half size is every second texel") {
  Clip clip(41, 24);
  const FrameView frame = clip.frame(0, 6);
  const Reference full = reference(clip, frame, test_light());
  std::vector<double> expected;
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t y = 0; y < 24; y += 2)
      for (std::size_t x = 0; x < 41; x += 2)
        expected.push_back(full.values[(c * 24 + y) * 41 + x]);
  on_each_path(clip, [&](Relighter& relighter, const gles::Device* device) {
    require(relighter.set_light(test_light()));
    require(relighter.composite({&frame}));
    relighter.set_quality({-1, true});
    REQUIRE(relighter.width() == 21);
    REQUIRE(relighter.height() == 12);
    require(relighter.composite({&frame}));
    CHECK(relighter.stats().composites == 2);
    CHECK(worst_of(relighter, expected) <= tolerance(device, relighter.path()) * full.peak);
    if (device != nullptr) {
      const gles::LightMap map = take(relighter.texture());
      CHECK(map.width == 21);
      CHECK(map.place == gles::half_place(41, 24));
    }
    relighter.set_quality({});
    require(relighter.composite({&frame}));
    CHECK(worst_of(relighter, full.values) <= tolerance(device, relighter.path()) * full.peak);
  });
}

TEST_CASE("light maps of two clips fade into each other") {
  Clip clip, smaller(20, 12);
  const FrameView a = clip.frame(0, 1), b = clip.frame(0, 9), c = smaller.frame(0, 2);
  const Reference first = reference(clip, a, test_light()),
                  second = reference(clip, b, test_light());
  const Reference third = reference(smaller, c, test_light());
  on_each_path(clip, [&](Relighter& relighter, const gles::Device* device) {
    const double allowed = 2 * tolerance(device, relighter.path()) * first.peak;
    auto other = take(Relighter::create(clip.model_, clip.layers_, {device, relighter.path()}));
    require(relighter.set_light(test_light()));
    require(other->set_light(test_light()));
    require(relighter.composite({&a}));
    CHECK_FALSE(relighter.fade(*other, 0.5f));  // not composited yet
    require(other->composite({&b}));
    CHECK_FALSE(relighter.fade(*other, 1.5f));
    CHECK_FALSE(relighter.fade(relighter, 0.5f));
    require(relighter.fade(*other, 0.3f));
    std::vector<double> expected;
    for (std::size_t i = 0; i < first.values.size(); ++i)
      expected.push_back(std::lerp(first.values[i], second.values[i], 0.3));
    CHECK(worst_of(relighter, expected) <= allowed);
    require(relighter.composite({&a}));  // nothing new, and the fade is over
    CHECK(worst_of(relighter, first.values) <= allowed);

    // A smaller map is filtered: at texel (x, y) halfway to a quarter between four of its own.
    auto small =
        take(Relighter::create(smaller.model_, smaller.layers_, {device, relighter.path()}));
    require(small->set_light(test_light()));
    require(small->composite({&c}));
    require(relighter.fade(*small, 1));
    std::vector<float> values(first.values.size());
    require(relighter.read(values));
    double worst = 0;
    for (int y = 1; y < kHeight - 1; ++y)
      for (int x = 1; x < kWidth - 1; ++x) {
        const double px = (x + 0.5) / 2 - 0.5, py = (y + 0.5) / 2 - 0.5;
        const auto x0 = static_cast<std::size_t>(px), y0 = static_cast<std::size_t>(py);
        const double fx = px - static_cast<double>(x0), fy = py - static_cast<double>(y0);
        const auto at = [&](std::size_t j, std::size_t i) { return third.values[j * 20 + i]; };
        const double value = std::lerp(std::lerp(at(y0, x0), at(y0, x0 + 1), fx),
                                       std::lerp(at(y0 + 1, x0), at(y0 + 1, x0 + 1), fx), fy);
        const auto texel = static_cast<std::size_t>(y * kWidth + x);
        worst = std::max(worst, std::abs(static_cast<double>(values[texel]) - value));
      }
    // Besides, filters may have weights of 8 bits: 2^-9 of a difference below twice the peak, each
    // way.
    CHECK(worst <= 2 * tolerance(device, relighter.path()) * third.peak +
                       (device != nullptr ? 4 * std::exp2(-9) * third.peak : 0));
  });
}

TEST_CASE("a path is taken, or refused with a reason") {
  Clip clip;
  const auto without =
      Relighter::create(clip.model_, clip.layers_, {nullptr, CompositePath::kFused});
  REQUIRE_FALSE(without);
  CHECK(without.error().code == ErrorCode::kInvalid);
  auto relighter = take(Relighter::create(clip.model_, clip.layers_, {}));
  CHECK(relighter->path() == CompositePath::kCpu);
  CHECK_FALSE(relighter->wants_measuring(1e4));
  CHECK_FALSE(relighter->set_path(CompositePath::kTexture));
  CHECK(relighter->path() == CompositePath::kCpu);
  CHECK_FALSE(relighter->texture());
}

namespace {

std::vector<std::uint8_t> picture_of(gles::Framebuffer& framebuffer) {
  require(framebuffer.resolve());
  std::vector<std::uint8_t> rgba(4 * 48 * 48);
  require(framebuffer.read_back(rgba));
  return rgba;
}

int largest_difference(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  REQUIRE(a.size() == b.size());
  int most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

}  // namespace

TEST_CASE("kAuto measures, and draws the same picture whatever it takes") {
  Clip clip;
  const FrameView a = clip.frame(0, 1), b = clip.frame(1, 2);
  on_each_backend([&](const gles::Device& device, const relit::test::Backend& backend) {
    auto renderer = take(gles::CharacterRenderer::create(device));
    const relit::test::Quad quad;
    const gles::MeshView mesh = quad.view();
    const gles::MaterialView material;
    require(renderer->set_materials({}, std::span(&material, 1)));
    require(renderer->set_meshes(std::span(&mesh, 1)));
    require(renderer->update_positions(0, quad.positions));
    auto framebuffer = take(gles::Framebuffer::create(device, {48, 48, 1}));
    gles::View view;
    view.width = view.height = 48;
    auto relighter = take(Relighter::create(clip.model_, clip.layers_, {&device}));
    require(relighter->set_light(test_light()));
    const FrameMix mix{&a, &b, 0.5f};
    const auto draw = [&] {
      framebuffer.bind();
      require(relighter->composite(mix));
      require(relighter->draw(*renderer, view));
      return picture_of(framebuffer);
    };
    // Each call is a picture of its own, and the right one.
    int pictures = 0;
    std::vector<std::vector<std::uint8_t>> measured;
    for (bool chosen = false; !chosen; ++pictures) {
      CHECK(relighter->wants_measuring(48 * 48));
      framebuffer.bind();
      chosen = take(relighter->measure(mix, *renderer, view));
      measured.push_back(picture_of(framebuffer));
    }
    CHECK_FALSE(relighter->wants_measuring(48 * 48));
    CHECK(relighter->path() != CompositePath::kAuto);
    std::printf("%s: %s\n", backend.name, relighter->why().c_str());
    const bool mediump = device.profile() == gles::Profile::kEs2Mediump;
    CHECK((relighter->why().find("fused") == std::string::npos) == mediump);
    const std::vector<std::uint8_t> chosen = draw();
    // Errors of 2^-10 of the peak, at most 2, where the sRGB curve is steepest, 12.92 at black:
    // 12.92 · 2 · 2^-10 · 255 levels; mediump 2e-2 of it where it is still that steep.
    const int most = mediump ? 30 : 7;
    CHECK(pictures == 4 * (mediump ? 2 : 3));
    for (const auto& picture : measured) CHECK(largest_difference(picture, chosen) <= most);
    for (const CompositePath path :
         {CompositePath::kCpu, CompositePath::kTexture, CompositePath::kFused}) {
      if (mediump && path == CompositePath::kFused) continue;
      require(relighter->set_path(path));
      // Set, and not composited yet: what was composited is drawn.
      framebuffer.bind();
      require(relighter->draw(*renderer, view));
      CAPTURE(composite_path_name(path));
      CHECK(largest_difference(picture_of(framebuffer), chosen) <= most);
      CHECK(largest_difference(draw(), chosen) <= most);
    }
    device.gl().BindFramebuffer(GL_FRAMEBUFFER, 0);
  });
}

}  // namespace relit::player
