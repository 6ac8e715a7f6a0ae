// SPDX-License-Identifier: MIT
// Prediction by normals of no length, by s of nothing and of much.
#include <cmath>

#include "decoders/composite_kernels.hpp"
#include "tests/extremes/rows.hpp"
#include "tests/gles/backends.hpp"
#include "tests/gles/predicted_scene.hpp"
#include "tests/results.hpp"

using namespace relit;
using namespace relit::test;

namespace {

void hold_scene(const std::string& name, const PredictedScene& scene, double most) {
  const Scene::Reference r = scene.reference();
  Worst cpu, highp, mediump;
  std::vector<float> values(r.values.size());
  decoders::CompositeJob job = scene.job();
  job.out = values;
  require(job.validate());
  const reference::Composite expected = reference::composite(job);
  for (const decoders::CompositeKernel& kernel : decoders::composite_kernels()) {
    kernel.run(job);
    for (std::size_t i = 0; i < values.size(); ++i)
      cpu.add(std::abs(double{values[i]} - expected.value[i]) / r.peak,
              reference::composite_bound(job, expected.magnitude[i]) / r.peak);
  }
  on_each_backend([&](const gles::Device& device, const Backend&) {
    auto compositor = take(gles::Compositor::create(device, scene.description_));
    require(compositor->upload(scene.views_));
    take(compositor->composite(scene.light_));
    require(compositor->read_back(values));
    Worst& worst = device.profile() == gles::Profile::kEs2Mediump ? mediump : highp;
    const double bound =
        predicted_bound(device, compositor->pass_count(), r, scene, 1, most) / r.peak;
    for (std::size_t i = 0; i < values.size(); ++i)
      worst.add(std::abs(double{values[i]} - r.values[i]) / r.peak, bound);
  });
  hold(name + ", CPU, of the peak", "(K+18) u S", cpu);
  hold(name + ", ES 3, ES 2, OSMesa, of the peak", "p t V + (K+25) u S + N", highp);
  hold(name + ", ES 2 mediump, of the peak", "(K+21) h S + p t S + N", mediump);
}

const Case kPlanes{"planes", 48, 40, 3, 10, false, -1, false};
const Case kS{"s", 48, 40, 1, 10, false, -1, false};

}  // namespace

TEST_CASE("normals of length zero predict by the harmonics that have no direction") {
  PredictedScene scene(kPlanes, kS);
  scene.clear_normals();
  hold_scene("all normals of length 0", scene, 1);
}

TEST_CASE("s of zero predicts nothing, and a large one no more than it says") {
  std::vector<std::uint16_t> zeros(48 * 40, 512);
  PredictedScene none(kPlanes, kS);
  none.views_[0].mantissa = {reinterpret_cast<const std::uint8_t*>(zeros.data()), 2 * 48, 48, 40,
                             2};
  hold_scene("s = 0", none, 0);
  for (const float size : {1e-6f, 1e6f}) {
    PredictedScene scene(kPlanes, kS);
    scene.views_[0].scale *= size;
    char name[32];
    std::snprintf(name, sizeof name, "s up to %g", double{size});
    hold_scene(name, scene, double{size});
  }
}

TEST_CASE("large s and normals of length zero together") {
  PredictedScene scene(kPlanes, kS);
  scene.views_[0].scale *= 1e4f;
  scene.clear_normals();
  hold_scene("s up to 1e4, all normals of length 0", scene, 1e4);
}
