// SPDX-License-Identifier: MIT
#pragma once

#include <bit>
#include <cfloat>
#include <cstdint>

#include "decoders/composite.hpp"
#include "decoders/sh_constants.hpp"

/// The composite's kernel, written once over a vector type V. Each composite_*.cpp includes it
/// after it has defined RELIT_KERNEL as the attribute that lets the compiler use the processor's
/// instructions; everything has internal linkage, so that no other file can be given code its
/// processor lacks.
///
/// All kernels do the same float operations in the same order, without fused multiply-adds, so
/// their results are equal bit for bit (32-bit NEON flushes subnormals: there, to 2^-126 per
/// plane).
#ifndef RELIT_KERNEL
#define RELIT_KERNEL
#endif

namespace relit::decoders {
namespace {

/// One texel at a time: the reference, and the ends of rows.
struct Scalar {
  using F = float;
  using I = std::int32_t;
  static constexpr int kLanes = 1;

  RELIT_KERNEL static F load(const float* p) { return *p; }
  RELIT_KERNEL static void store(float* p, F v) { *p = v; }
  RELIT_KERNEL static F set(float v) { return v; }
  RELIT_KERNEL static F add(F a, F b) { return a + b; }
  RELIT_KERNEL static F sub(F a, F b) { return a - b; }
  RELIT_KERNEL static F mul(F a, F b) { return a * b; }
  RELIT_KERNEL static I set_int(int v) { return v; }
  RELIT_KERNEL static I sub_int(I a, I b) { return a - b; }
  RELIT_KERNEL static F to_float(I v) { return static_cast<float>(v); }
  /// The samples of kLanes texels, each shown 2^kShift times, from p on (kShift -1: every second
  /// one of twice as many); the second argument is their type, which p need not be aligned for.
  template <int kShift>
  RELIT_KERNEL static I load_samples(const std::uint8_t* p, std::uint8_t) {
    return *p;
  }
  template <int kShift>
  RELIT_KERNEL static I load_samples(const std::uint8_t* p, std::uint16_t) {
    std::uint16_t v;
    __builtin_memcpy(&v, p, sizeof v);
    return v;
  }
  /// 2^(e - zero), and 0 for e = 0. The product of two normal powers of two is exact even where it
  /// is subnormal: e in 0..255, zero in 128..150.
  RELIT_KERNEL static F step(I e, int zero) {
    if (e == 0) return 0;
    const int half = e >> 1;
    const auto power = [](int exponent) {
      return std::bit_cast<float>(static_cast<std::uint32_t>(exponent + 127) << 23);
    };
    return power(half - 64) * power(e - half - zero + 64);
  }
  /// Into the range of finite floats; what is not a number becomes FLT_MAX.
  RELIT_KERNEL static F saturate(F v) {
    const float below = v < FLT_MAX ? v : FLT_MAX;
    return below > -FLT_MAX ? below : -FLT_MAX;
  }
  RELIT_KERNEL static void load_vectors(const float* p, F& x, F& y, F& z) {
    x = p[0];
    y = p[1];
    z = p[2];
  }
};

/// A part of the output that stays in the first-level cache while all planes are added to it.
struct Tile {
  static constexpr int kTexels = 1024;
  int x = 0, y = 0, width = 0, height = 0;
  /// As much of a row as vectors may be loaded for: one less where the last texel of a half-sized
  /// map has no neighbour, since every second sample is got by loading all of them.
  int vector_width = 0;
};

/// Where the sample of a texel is, from the tile's or the picture's beginning.
template <int kShift>
RELIT_KERNEL constexpr std::ptrdiff_t sample_at(int texel) {
  if constexpr (kShift < 0) return static_cast<std::ptrdiff_t>(texel) << -kShift;
  return texel >> (kShift < 0 ? 0 : kShift);
}
RELIT_KERNEL inline std::ptrdiff_t sample_at(int texel, int shift) {
  return shift < 0 ? static_cast<std::ptrdiff_t>(texel) << -shift : texel >> shift;
}

/// What a plane adds to a tile. All pointers are to the tile's first column; `row` moves them.
struct PlaneJob {
  const std::uint8_t* mantissas = nullptr;  ///< row 0 of the picture
  std::ptrdiff_t mantissa_stride = 0;
  const float* steps = nullptr;  ///< one for each texel of the tile, or null
  int zero = 0;
  int shift = 0;         ///< of the mantissas; one less where every second texel is composited
  bool wide = false;     ///< two bytes a sample
  float weight[3] = {};  ///< the plane's scale included
  int channel = 0;       ///< when there is only one
  float* out[3] = {};    ///< the tile's first row
  std::ptrdiff_t out_stride = 0;
  const float* normals = nullptr;          ///< the tile's first row
  const float (*prediction)[3] = nullptr;  ///< [9][rgb]
};

/// One row of a PlaneJob.
struct Row {
  const std::uint8_t* mantissas;
  const float* steps;
  float* out[3];
  const float* normals;
};

template <int kShift>
RELIT_KERNEL inline Row row_of(const PlaneJob& job, const Tile& tile, int i) {
  const std::ptrdiff_t at = i * job.out_stride;
  return {job.mantissas + sample_at<kShift>(tile.y + i) * job.mantissa_stride,
          job.steps == nullptr ? nullptr : job.steps + static_cast<std::ptrdiff_t>(i) * tile.width,
          {job.out[0] + at, job.out[1] + at, job.out[2] + at},
          job.normals == nullptr ? nullptr : job.normals + 3 * at};
}

template <class V, class Sample, int kShift, bool kStepped>
RELIT_KERNEL inline typename V::F value_at(const Row& row, typename V::I zero, int x) {
  const std::uint8_t* samples =
      row.mantissas + sample_at<kShift>(x) * static_cast<std::ptrdiff_t>(sizeof(Sample));
  const auto mantissa = V::template load_samples<kShift>(samples, Sample{});
  const auto value = V::to_float(V::sub_int(mantissa, zero));
  if constexpr (kStepped) return V::mul(value, V::load(row.steps + x));
  return value;
}

/// out[c] += Σ weight[c] · value of kPlanes planes in turn, for one channel or all, from texel `x`
/// of the row while a whole vector is left. Returns the first texel not done. Several planes at
/// once load and store the sum once, and add to it in the same order.
template <class V, class Sample, int kShift, bool kStepped, bool kOneChannel, int kPlanes>
RELIT_KERNEL inline int accumulate(const PlaneJob* jobs, const Row* rows, int x, int width) {
  using F = typename V::F;
  const auto zero = V::set_int(jobs[0].zero);
  const int channel = kOneChannel ? jobs[0].channel : 0;
  F weights[kPlanes][3];
  for (int p = 0; p < kPlanes; ++p) {
    weights[p][0] = V::set(jobs[p].weight[channel]);
    if constexpr (kOneChannel) continue;
    weights[p][1] = V::set(jobs[p].weight[1]);
    weights[p][2] = V::set(jobs[p].weight[2]);
  }
  float* const out0 = rows[0].out[channel];
  float* const out1 = rows[0].out[1];
  float* const out2 = rows[0].out[2];
  for (; x + V::kLanes <= width; x += V::kLanes) {
    F sum0 = V::load(out0 + x), sum1 = sum0, sum2 = sum0;
    if constexpr (!kOneChannel) sum1 = V::load(out1 + x), sum2 = V::load(out2 + x);
    for (int p = 0; p < kPlanes; ++p) {
      const F value = value_at<V, Sample, kShift, kStepped>(rows[p], zero, x);
      sum0 = V::add(sum0, V::mul(weights[p][0], value));
      if constexpr (kOneChannel) continue;
      sum1 = V::add(sum1, V::mul(weights[p][1], value));
      sum2 = V::add(sum2, V::mul(weights[p][2], value));
    }
    V::store(out0 + x, sum0);
    if constexpr (kOneChannel) continue;
    V::store(out1 + x, sum1);
    V::store(out2 + x, sum2);
  }
  return x;
}

/// out[c] += value · E_c(N), E's polynomial being `prediction`, with the plane's scale in it.
template <class V, class Sample, int kShift, bool kStepped>
RELIT_KERNEL inline int predict(const PlaneJob& job, const Row& row, int x, int width) {
  using F = typename V::F;
  const auto zero = V::set_int(job.zero);
  for (; x + V::kLanes <= width; x += V::kLanes) {
    F nx, ny, nz;
    V::load_vectors(row.normals + 3 * static_cast<std::ptrdiff_t>(x), nx, ny, nz);
    const F zz3 = V::mul(V::mul(nz, nz), V::set(3));
    const F polynomial[9] = {V::set(1),
                             ny,
                             nz,
                             nx,
                             V::mul(nx, ny),
                             V::mul(ny, nz),
                             V::sub(zz3, V::set(1)),
                             V::mul(nx, nz),
                             V::sub(V::mul(nx, nx), V::mul(ny, ny))};
    const F value = value_at<V, Sample, kShift, kStepped>(row, zero, x);
    for (int c = 0; c < 3; ++c) {
      F sum = V::set(job.prediction[0][c]);
      for (int n = 1; n < 9; ++n) {
        sum = V::add(sum, V::mul(V::set(job.prediction[n][c]), polynomial[n]));
      }
      float* const out = row.out[c] + x;
      V::store(out, V::add(V::load(out), V::mul(value, sum)));
    }
  }
  return x;
}

/// How many planes are added in one pass over a tile.
constexpr int kMostPlanes = 4;

enum class Operation { kAccumulateOne, kAccumulateAll, kPredict };

template <class V, class Sample, int kShift, bool kStepped, bool kOneChannel, int kPlanes>
RELIT_KERNEL void accumulate_rows(const PlaneJob* jobs, const Tile& tile) {
  for (int i = 0; i < tile.height; ++i) {
    Row rows[kPlanes];
    for (int p = 0; p < kPlanes; ++p) rows[p] = row_of<kShift>(jobs[p], tile, i);
    const int x = accumulate<V, Sample, kShift, kStepped, kOneChannel, kPlanes>(jobs, rows, 0,
                                                                                tile.vector_width);
    accumulate<Scalar, Sample, kShift, kStepped, kOneChannel, kPlanes>(jobs, rows, x, tile.width);
  }
}

template <class V, class Sample, int kShift, bool kStepped, bool kOneChannel>
RELIT_KERNEL void accumulate_planes(const PlaneJob* jobs, int count, const Tile& tile) {
  if (count == kMostPlanes)
    return accumulate_rows<V, Sample, kShift, kStepped, kOneChannel, kMostPlanes>(jobs, tile);
  for (int p = 0; p < count; ++p)
    accumulate_rows<V, Sample, kShift, kStepped, kOneChannel, 1>(jobs + p, tile);
}

template <class V, class Sample, int kShift, bool kStepped>
RELIT_KERNEL void run_rows(const PlaneJob* jobs, int count, Operation operation, const Tile& tile) {
  switch (operation) {
    case Operation::kAccumulateOne:
      return accumulate_planes<V, Sample, kShift, kStepped, true>(jobs, count, tile);
    case Operation::kAccumulateAll:
      return accumulate_planes<V, Sample, kShift, kStepped, false>(jobs, count, tile);
    case Operation::kPredict:
      break;
  }
  for (int i = 0; i < tile.height; ++i) {
    const Row row = row_of<kShift>(jobs[0], tile, i);
    const int x = predict<V, Sample, kShift, kStepped>(jobs[0], row, 0, tile.vector_width);
    predict<Scalar, Sample, kShift, kStepped>(jobs[0], row, x, tile.width);
  }
}

template <class V, class Sample, int kShift>
RELIT_KERNEL void run_sampled(const PlaneJob* jobs, int count, Operation operation,
                              const Tile& tile) {
  if (jobs[0].steps != nullptr)
    return run_rows<V, Sample, kShift, true>(jobs, count, operation, tile);
  run_rows<V, Sample, kShift, false>(jobs, count, operation, tile);
}

template <class V, class Sample>
RELIT_KERNEL void run_shifted(const PlaneJob* jobs, int count, Operation operation,
                              const Tile& tile) {
  if (jobs[0].shift < 0) return run_sampled<V, Sample, -1>(jobs, count, operation, tile);
  if (jobs[0].shift > 0) return run_sampled<V, Sample, 1>(jobs, count, operation, tile);
  run_sampled<V, Sample, 0>(jobs, count, operation, tile);
}

/// Adds planes of one kind (see same_kind()) to a tile, in turn.
template <class V>
RELIT_KERNEL void run_planes(const PlaneJob* jobs, int count, Operation operation,
                             const Tile& tile) {
  if (jobs[0].wide) return run_shifted<V, std::uint16_t>(jobs, count, operation, tile);
  run_shifted<V, std::uint8_t>(jobs, count, operation, tile);
}

RELIT_KERNEL inline bool same_kind(const PlaneJob& a, const PlaneJob& b) {
  return a.wide == b.wide && a.shift == b.shift && a.zero == b.zero &&
         (a.steps == nullptr) == (b.steps == nullptr);
}

template <class V, int kShift>
RELIT_KERNEL void expand_steps(const std::uint8_t* exponents, int zero, float* steps,
                               const Tile& tile) {
  int x = 0;
  for (; x + V::kLanes <= tile.vector_width; x += V::kLanes) {
    const std::uint8_t* p = exponents + sample_at<kShift>(x);
    if constexpr (kShift < 0 || (1 << (kShift < 0 ? 0 : kShift)) < V::kLanes) {
      V::store(steps + x, V::step(V::template load_samples<kShift>(p, std::uint8_t{}), zero));
    } else {
      V::store(steps + x, V::set(Scalar::step(*p, zero)));
    }
  }
  for (; x < tile.width; ++x) steps[x] = Scalar::step(exponents[sample_at<kShift>(x)], zero);
}

template <class V>
RELIT_KERNEL void expand_row(const std::uint8_t* exponents, int shift, int zero, float* steps,
                             const Tile& tile) {
  switch (shift) {
    case -1:
      return expand_steps<V, -1>(exponents, zero, steps, tile);
    case 0:
      return expand_steps<V, 0>(exponents, zero, steps, tile);
    case 1:
      return expand_steps<V, 1>(exponents, zero, steps, tile);
    case 2:
      return expand_steps<V, 2>(exponents, zero, steps, tile);
    case 3:
      return expand_steps<V, 3>(exponents, zero, steps, tile);
    case 4:
      return expand_steps<V, 4>(exponents, zero, steps, tile);
    default:
      return expand_steps<V, 5>(exponents, zero, steps, tile);
  }
}

/// 2^(E - E₀) for every texel of the tile, rows of tile.width.
template <class V>
RELIT_KERNEL void tile_steps(const PlaneView& plane, int halved, const Tile& tile, float* steps) {
  const int shift = plane.exponent_shift - halved;
  for (int i = 0; i < tile.height; ++i) {
    const int y = tile.y + i;
    float* const row = steps + static_cast<std::ptrdiff_t>(i) * tile.width;
    if (i > 0 && sample_at(y, shift) == sample_at(y - 1, shift)) {
      __builtin_memcpy(row, row - tile.width, static_cast<std::size_t>(tile.width) * sizeof(float));
      continue;
    }
    const std::uint8_t* exponents = plane.exponent.data +
                                    sample_at(y, shift) * plane.exponent.stride_bytes +
                                    sample_at(tile.x, shift);
    expand_row<V>(exponents, shift, plane.exponent_zero, row, tile);
  }
}

RELIT_KERNEL inline bool same_steps(const PlaneView& a, const PlaneView& b) {
  return a.exponent.data == b.exponent.data && a.exponent.stride_bytes == b.exponent.stride_bytes &&
         a.exponent_shift == b.exponent_shift && a.exponent_zero == b.exponent_zero;
}

/// The factors of E(N)'s polynomial, with `scale`: the plane's times its share.
RELIT_KERNEL inline void fold_prediction(const FoldedLight& light, double scale,
                                         float (&factors)[9][3]) {
  constexpr double kFactor[9] = {kBand0,   kBand1,   kBand1,   kBand1,      kBand2Xy,
                                 kBand2Xy, kBand2Zz, kBand2Xy, kBand2Xy / 2};
  for (std::size_t n = 0; n < 9; ++n) {
    for (std::size_t c = 0; c < 3; ++c) {
      factors[n][c] =
          static_cast<float>(kFactor[n] * static_cast<double>(light.irradiance[n][c]) * scale);
    }
  }
}

/// The first texel of a channel's tile, rows of out_width() apart.
RELIT_KERNEL inline float* out_at(const CompositeJob& job, int channel, const Tile& tile) {
  const std::ptrdiff_t width = job.out_width();
  return job.out.data() + channel * width * job.out_height() + tile.y * width + tile.x;
}

template <class V>
RELIT_KERNEL void fill(const CompositeJob& job, const Tile& tile) {
  for (int c = 0; c < 3; ++c) {
    float* out = out_at(job, c, tile);
    const float constant = job.light.constant[static_cast<std::size_t>(c)];
    for (int y = 0; y < tile.height; ++y, out += job.out_width()) {
      int x = 0;
      for (; x + V::kLanes <= tile.width; x += V::kLanes) V::store(out + x, V::set(constant));
      for (; x < tile.width; ++x) out[x] = constant;
    }
  }
}

template <class V>
RELIT_KERNEL void saturate(const CompositeJob& job, const Tile& tile) {
  for (int c = 0; c < 3; ++c) {
    float* out = out_at(job, c, tile);
    for (int y = 0; y < tile.height; ++y, out += job.out_width()) {
      int x = 0;
      for (; x + V::kLanes <= tile.width; x += V::kLanes) {
        V::store(out + x, V::saturate(V::load(out + x)));
      }
      for (; x < tile.width; ++x) out[x] = Scalar::saturate(out[x]);
    }
  }
}

/// Everything of the plane's job but the steps. Returns how many channels have a weight.
RELIT_KERNEL inline int aim(const CompositeJob& job, std::size_t k, const Tile& tile,
                            PlaneJob& out) {
  const PlaneView& plane = job.planes[k];
  out.shift = plane.mantissa_shift - (job.every - 1);
  out.wide = plane.mantissa.bytes_per_sample == 2;
  out.mantissas =
      plane.mantissa.data + sample_at(tile.x, out.shift) * plane.mantissa.bytes_per_sample;
  out.mantissa_stride = plane.mantissa.stride_bytes;
  out.zero = plane.mantissa_zero;
  out.out_stride = job.out_width();
  int used = 0;
  for (int c = 0; c < 3; ++c) {
    out.out[c] = out_at(job, c, tile);
    out.weight[c] =
        static_cast<float>(static_cast<double>(job.light.weights[k][static_cast<std::size_t>(c)]) *
                           static_cast<double>(plane.scale));
    if (out.weight[c] == 0) continue;
    ++used;
    out.channel = c;
  }
  return used;
}

/// Planes that wait to be added together: those of one channel in a queue each, those of all
/// channels in the last. Every channel gets its planes in their order.
template <class V>
class Queues {
 public:
  RELIT_KERNEL explicit Queues(const Tile& tile) : tile_(tile) {}

  RELIT_KERNEL void add(const PlaneJob& job, int channels) {
    Queue& queue = queues_[channels == 1 ? job.channel : kAll];
    // Planes of all channels and of one must not overtake each other.
    if (channels == 1 && queues_[kAll].count > 0) flush(kAll);
    if (channels > 1) {
      for (int c = 0; c < kAll; ++c) flush(c);
    }
    if (queue.count > 0 && !same_kind(queue.jobs[0], job))
      flush(channels == 1 ? job.channel : kAll);
    queue.jobs[queue.count++] = job;
    if (queue.count == kMostPlanes) flush(channels == 1 ? job.channel : kAll);
  }
  RELIT_KERNEL void flush_all() {
    for (int c = 0; c <= kAll; ++c) flush(c);
  }

 private:
  static constexpr int kAll = 3;
  struct Queue {
    PlaneJob jobs[kMostPlanes];
    int count = 0;
  };

  RELIT_KERNEL void flush(int index) {
    Queue& queue = queues_[index];
    if (queue.count == 0) return;
    run_planes<V>(queue.jobs, queue.count,
                  index == kAll ? Operation::kAccumulateAll : Operation::kAccumulateOne, tile_);
    queue.count = 0;
  }

  const Tile& tile_;
  Queue queues_[kAll + 1];
};

template <class V>
RELIT_KERNEL void run_tile(const CompositeJob& job, const Tile& tile) {
  // As many sets of steps as there can be planes waiting that need different ones.
  alignas(32) float steps[kMostPlanes][Tile::kTexels];
  int used_steps = 0;
  const PlaneView* stepped = nullptr;  // whose steps the last are: an RGB group shares them
  Queues<V> queues(tile);
  fill<V>(job, tile);
  for (std::size_t k = 0; k < job.planes.size(); ++k) {
    const PlaneView& plane = job.planes[k];
    const CompositePrediction* predicts = nullptr;
    for (const CompositePrediction& prediction : job.predictions)
      if (prediction.plane == static_cast<int>(k)) predicts = &prediction;
    PlaneJob add;
    const int channels = aim(job, k, tile, add);
    if (plane.mantissa.empty() || (channels == 0 && predicts == nullptr)) continue;
    if (!plane.exponent.empty()) {
      if (stepped == nullptr || !same_steps(*stepped, plane)) {
        if (used_steps == kMostPlanes) {
          queues.flush_all();
          used_steps = 0;
        }
        tile_steps<V>(plane, job.every - 1, tile, steps[used_steps++]);
      }
      stepped = &plane;
      add.steps = steps[used_steps - 1];
    }
    if (channels > 0) queues.add(add, channels);
    if (predicts != nullptr) {
      float factors[9][3];
      fold_prediction(job.light,
                      static_cast<double>(plane.scale) * static_cast<double>(predicts->share),
                      factors);
      add.prediction = factors;
      add.normals = &predicts
                         ->normals[static_cast<std::size_t>(tile.y) *
                                       static_cast<std::size_t>(job.out_width()) +
                                   static_cast<std::size_t>(tile.x)]
                         .x;
      queues.flush_all();
      run_planes<V>(&add, 1, Operation::kPredict, tile);
    }
  }
  queues.flush_all();
  saturate<V>(job, tile);
}

/// The whole light map, tile by tile. Tiles begin at multiples of 1024 columns, so that no sample
/// of a shared exponent or of 4:2:0 chroma straddles two.
template <class V>
RELIT_KERNEL void run_composite(const CompositeJob& job) {
  const int width = job.out_width(), height = job.out_height();
  for (int x = 0; x < width; x += Tile::kTexels) {
    Tile tile;
    tile.x = x;
    tile.width = width - x < Tile::kTexels ? width - x : Tile::kTexels;
    const bool last_alone = job.every * width > job.width && x + tile.width == width;
    tile.vector_width = tile.width - (last_alone ? 1 : 0);
    const int rows = Tile::kTexels / tile.width;
    for (tile.y = 0; tile.y < height; tile.y += rows) {
      tile.height = height - tile.y < rows ? height - tile.y : rows;
      run_tile<V>(job, tile);
    }
  }
}

}  // namespace
}  // namespace relit::decoders
