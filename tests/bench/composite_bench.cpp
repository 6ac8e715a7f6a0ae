// SPDX-License-Identifier: MIT
// The CPU composite, every kernel of this processor in one run: compare the lines, not the times.
// At the end, how fast it reads planes of 512² texels compared with memcpy() of the same bytes.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "decoders/composite.hpp"
#include "decoders/composite_kernels.hpp"

namespace relit::decoders {
namespace {

constexpr int kSide = 128;
constexpr int kLargeSide = 512;

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
  std::vector<float> out;
  CompositeJob job;

  explicit Scene(const Content& content, int side = kSide) {
    std::mt19937 random(1);
    const std::size_t texels = static_cast<std::size_t>(side) * static_cast<std::size_t>(side);
    out.resize(3 * texels);
    const auto count = static_cast<std::size_t>(content.planes);
    const std::size_t plane_bytes = texels * static_cast<std::size_t>(content.bytes_per_sample);
    mantissas.resize(count * plane_bytes);
    exponents.resize(count * texels);
    for (std::size_t i = 0; i < mantissas.size(); ++i) {
      const bool high_byte = content.bytes_per_sample == 2 && i % 2 == 1;
      mantissas[i] = static_cast<std::uint8_t>(high_byte ? random() % 4 : random());
    }
    for (auto& byte : exponents) byte = static_cast<std::uint8_t>(125 + random() % 12);
    for (std::size_t k = 0; k < count; ++k) {
      PlaneView plane;
      plane.mantissa = {mantissas.data() + k * plane_bytes, side * content.bytes_per_sample, side,
                        side, content.bytes_per_sample};
      plane.mantissa_shift = k % 3 == 0 ? 0 : content.chroma_shift;
      plane.mantissa_zero = content.bytes_per_sample == 1 ? 128 : 512;
      plane.exponent_shift = content.exponent_shift;
      if (content.planes_per_exponent > 0) {
        const std::size_t group = k / static_cast<std::size_t>(content.planes_per_exponent);
        plane.exponent = {exponents.data() + group * texels, side, side, side, 1};
      }
      planes.push_back(plane);
      Rgb weight{0.5f, 0.25f, -0.125f};
      if (content.one_channel) weight = {}, weight[k % 3] = 0.5f;
      weights.push_back(weight);
    }
    if (content.prediction) {
      job.light.irradiance.fill({0.3f, 0.2f, 0.1f});
      normals.assign(texels, glm::vec3(0.6f, 0.0f, 0.8f));
      job.predictions[0] = {0, normals, 1};
    }
    job.planes = planes;
    job.light.weights = weights;
    job.width = job.height = side;
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

/// Of this thread's processor time, so that others on the machine do not count.
double seconds(const std::function<void()>& work) {
  const auto now = [] {
    timespec at{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &at);
    return static_cast<double>(at.tv_sec) + 1e-9 * static_cast<double>(at.tv_nsec);
  };
  const double start = now();
  work();
  return now() - start;
}

/// Plane bytes a second of the composite over those of memcpy(), taken in turn on one thread.
void print_bandwidth(const Content& content) {
  constexpr int kPairs = 31;
  Scene scene(content, kLargeSide);
  if (!scene.job.validate()) return;
  std::vector<std::uint8_t> copy(scene.mantissas.size());
  std::vector<double> ratios;
  for (int i = 0; i < kPairs; ++i) {
    const double copied_s = seconds([&] {
      std::memcpy(copy.data(), scene.mantissas.data(), copy.size());
      benchmark::ClobberMemory();
    });
    const double composited_s = seconds([&] {
      scene.job.run();
      benchmark::ClobberMemory();
    });
    if (i > 0) ratios.push_back(copied_s / composited_s);
  }
  std::sort(ratios.begin(), ratios.end());
  std::printf("%-40s 512x512, %s: plane bytes at %.2f of memcpy's speed (%.2f to %.2f)\n",
              content.name, composite_kernel(), ratios[ratios.size() / 2],
              ratios[ratios.size() / 10], ratios[ratios.size() * 9 / 10]);
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
  for (const Content& content : {Content{"16 RGB tiles", 48, true, 0, 0, 1, 0, false},
                                 Content{"48 principal planes", 48, false, 0, 0, 1, 0, false}})
    print_bandwidth(content);
  return 0;
}
