// SPDX-License-Identifier: MIT
// The CPU composite, every kernel of this processor in one run: compare the lines, not the times.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "decoders/composite.hpp"
#include "decoders/composite_kernels.hpp"

namespace relit::decoders {
namespace {

constexpr int kSide = 128;
constexpr std::size_t kTexels = std::size_t{kSide} * kSide;

struct Content {
  const char* name;
  int planes;
  bool one_channel;         ///< RGB tiles: each plane adds to one channel
  int planes_per_exponent;  ///< 0: no exponents
  int exponent_shift;
  int bytes_per_sample;
  int chroma_shift;  ///< mantissa shift of the second and third plane of each three
  bool prediction;
};

/// One light map's worth of planes, side by side in memory as a decoder leaves them.
struct Scene {
  std::vector<std::uint8_t> mantissas, exponents;
  std::vector<PlaneView> planes;
  std::vector<Rgb> weights;
  std::vector<glm::vec3> normals;
  std::vector<float> out = std::vector<float>(3 * kTexels);
  CompositeJob job;

  explicit Scene(const Content& content) {
    std::mt19937 random(1);
    const auto count = static_cast<std::size_t>(content.planes);
    const std::size_t plane_bytes = kTexels * static_cast<std::size_t>(content.bytes_per_sample);
    mantissas.resize(count * plane_bytes);
    exponents.resize(count * kTexels);
    for (std::size_t i = 0; i < mantissas.size(); ++i) {
      const bool high_byte = content.bytes_per_sample == 2 && i % 2 == 1;
      mantissas[i] = static_cast<std::uint8_t>(high_byte ? random() % 4 : random());
    }
    for (auto& byte : exponents) byte = static_cast<std::uint8_t>(125 + random() % 12);
    for (std::size_t k = 0; k < count; ++k) {
      PlaneView plane;
      plane.mantissa = {mantissas.data() + k * plane_bytes, kSide * content.bytes_per_sample, kSide,
                        kSide, content.bytes_per_sample};
      plane.mantissa_shift = k % 3 == 0 ? 0 : content.chroma_shift;
      plane.mantissa_zero = content.bytes_per_sample == 1 ? 128 : 512;
      plane.exponent_shift = content.exponent_shift;
      if (content.planes_per_exponent > 0) {
        const std::size_t group = k / static_cast<std::size_t>(content.planes_per_exponent);
        plane.exponent = {exponents.data() + group * kTexels, kSide, kSide, kSide, 1};
      }
      planes.push_back(plane);
      Rgb weight{0.5f, 0.25f, -0.125f};
      if (content.one_channel) weight = {}, weight[k % 3] = 0.5f;
      weights.push_back(weight);
    }
    if (content.prediction) {
      job.light.prediction_plane = 0;
      job.light.irradiance.fill({0.3f, 0.2f, 0.1f});
      normals.assign(kTexels, glm::vec3(0.6f, 0.0f, 0.8f));
    }
    job.planes = planes;
    job.light.weights = weights;
    job.width = job.height = kSide;
    job.normals = normals;
    job.out = out;
  }
};

void run(benchmark::State& state, const Content& content, const CompositeKernel& kernel) {
  Scene scene(content);
  if (!scene.job.validate()) {
    state.SkipWithError("the job is not valid");
    return;
  }
  for (auto _ : state) {
    kernel.run(scene.job);
    benchmark::ClobberMemory();
  }
  state.counters["planes/s"] =
      benchmark::Counter(content.planes, benchmark::Counter::kIsIterationInvariantRate);
}

}  // namespace
}  // namespace relit::decoders

int main(int argc, char** argv) {
  using namespace relit::decoders;
  static constexpr Content kContents[] = {
      {"9 RGB tiles, exponent per texel", 27, true, 3, 0, 1, 0, false},
      {"9 RGB tiles, 16x16 blocks", 27, true, 3, 4, 1, 0, false},
      {"9 YCoCg 4:2:0 tiles, 16x16 blocks", 27, false, 3, 4, 1, 1, false},
      {"15 principal planes, 8 bit", 15, false, 0, 0, 1, 0, false},
      {"15 principal planes, 10 bit", 15, false, 0, 0, 2, 0, false},
      {"prediction and 14 planes, 10 bit", 15, false, 0, 0, 2, 0, true},
  };
  for (const Content& content : kContents) {
    for (const CompositeKernel& kernel : composite_kernels()) {
      const std::string name = std::string(content.name) + "/" + kernel.name;
      benchmark::RegisterBenchmark(name.c_str(), run, content, kernel)
          ->Unit(benchmark::kMicrosecond);
    }
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
