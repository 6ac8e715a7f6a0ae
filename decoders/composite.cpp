// SPDX-License-Identifier: MIT
#include "decoders/composite.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <string>

#include "container/base/limits.hpp"
#include "decoders/composite_kernel.hpp"
#include "decoders/composite_kernels.hpp"

namespace relit::decoders {
namespace {

struct KernelList {
  std::array<CompositeKernel, 4> kernels{};
  std::size_t count = 0;

  KernelList() {
    add({"scalar", composite_scalar});
#if defined(__x86_64__)
    add({"sse2", composite_sse2});
    if (__builtin_cpu_supports("avx2")) add({"avx2", composite_avx2});
#endif
#if defined(__ARM_NEON)
    add({"neon", composite_neon});
#endif
  }
  void add(CompositeKernel kernel) { kernels[count++] = kernel; }
};

bool finite(const Rgb& rgb) {
  return std::all_of(rgb.begin(), rgb.end(), [](float v) { return std::isfinite(v); });
}

bool is_zero(const Rgb& rgb) { return rgb == Rgb{}; }

std::string size_text(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

// Names are made only for errors: jobs are checked every frame.
std::string plane_name(std::size_t plane) { return "plane " + std::to_string(plane); }

/// Whether `view` has a sample for every texel of the light map, 2^shift texels to a sample.
Status check_view(const SampleView& view, int shift, const CompositeJob& job, std::size_t plane,
                  const char* samples) {
  const auto what = [&] { return plane_name(plane) + ": " + samples; };
  const int width = (job.width + (1 << shift) - 1) >> shift;
  const int height = (job.height + (1 << shift) - 1) >> shift;
  if (view.width < width || view.height < height) {
    return fail(ErrorCode::kInvalid, what() + " are " + size_text(view.width, view.height) +
                                         "; the light map needs " + size_text(width, height));
  }
  const std::ptrdiff_t row_bytes = std::ptrdiff_t{view.width} * view.bytes_per_sample;
  if (view.height > 1 && std::abs(view.stride_bytes) < row_bytes) {
    return fail(ErrorCode::kInvalid, what() + " have rows of " + std::to_string(row_bytes) +
                                         " bytes every " + std::to_string(view.stride_bytes));
  }
  return {};
}

Status check_plane(const PlaneView& plane, const CompositeJob& job, std::size_t k) {
  if (plane.mantissa.empty()) {
    return fail(ErrorCode::kInvalid, plane_name(k) + " has a weight but no mantissas");
  }
  if (plane.mantissa.bytes_per_sample != 1 && plane.mantissa.bytes_per_sample != 2) {
    return fail(ErrorCode::kInvalid, plane_name(k) + ": mantissas take 1 or 2 bytes, not " +
                                         std::to_string(plane.mantissa.bytes_per_sample));
  }
  if (plane.mantissa_shift != 0 && plane.mantissa_shift != 1) {
    return fail(ErrorCode::kInvalid, plane_name(k) + ": mantissa shift must be 0 or 1, not " +
                                         std::to_string(plane.mantissa_shift));
  }
  if (plane.mantissa_zero < 0 || plane.mantissa_zero > 65535) {
    return fail(ErrorCode::kInvalid, plane_name(k) + ": mantissa zero must be 0 to 65535, not " +
                                         std::to_string(plane.mantissa_zero));
  }
  if (!std::isfinite(plane.scale))
    return fail(ErrorCode::kInvalid, plane_name(k) + ": scale is not finite");
  RELIT_TRY(check_view(plane.mantissa, plane.mantissa_shift, job, k, "mantissas"));
  if (plane.exponent.empty()) return {};
  if (plane.exponent.bytes_per_sample != 1) {
    return fail(ErrorCode::kInvalid, plane_name(k) + ": exponents take 1 byte, not " +
                                         std::to_string(plane.exponent.bytes_per_sample));
  }
  if (plane.exponent_shift < 0 || plane.exponent_shift > 5) {
    return fail(ErrorCode::kInvalid, plane_name(k) + ": exponent shift must be 0 to 5, not " +
                                         std::to_string(plane.exponent_shift));
  }
  if (plane.exponent_zero < 128 || plane.exponent_zero > 150) {
    return fail(ErrorCode::kInvalid, plane_name(k) + ": exponent zero must be 128 to 150, not " +
                                         std::to_string(plane.exponent_zero));
  }
  return check_view(plane.exponent, plane.exponent_shift, job, k, "exponents");
}

Status check_light(const CompositeJob& job) {
  const FoldedLight& light = job.light;
  if (light.weights.size() != job.planes.size()) {
    return fail(ErrorCode::kInvalid, std::to_string(job.planes.size()) +
                                         " planes need as many weights, not " +
                                         std::to_string(light.weights.size()));
  }
  if (!finite(light.constant) || !std::all_of(light.weights.begin(), light.weights.end(), finite) ||
      !std::all_of(light.irradiance.begin(), light.irradiance.end(), finite)) {
    return fail(ErrorCode::kInvalid, "the folded light is not finite");
  }
  return {};
}

Status check_prediction(const CompositePrediction& prediction, std::size_t planes,
                        std::size_t texels) {
  if (prediction.plane < -1 || prediction.plane >= static_cast<int>(planes)) {
    return fail(ErrorCode::kInvalid, "prediction plane " + std::to_string(prediction.plane) +
                                         " is not one of " + std::to_string(planes));
  }
  if (prediction.plane < 0) return {};
  if (prediction.normals.size() != texels) {
    return fail(ErrorCode::kInvalid, "a prediction needs " + std::to_string(texels) +
                                         " normals, not " +
                                         std::to_string(prediction.normals.size()));
  }
  if (!(prediction.share >= 0) || prediction.share > 1)
    return fail(ErrorCode::kInvalid, "the share of a prediction is outside 0 to 1");
  return {};
}

}  // namespace

std::span<const CompositeKernel> composite_kernels() {
  static const KernelList list;
  return {list.kernels.data(), list.count};
}

const char* composite_kernel() { return composite_kernels().back().name; }

void composite_scalar(const CompositeJob& job) { run_composite<Scalar>(job); }

Status CompositeJob::validate() const {
  constexpr auto kSide = static_cast<int>(limits::kLightMapSide);
  if (width < 1 || height < 1 || width > kSide || height > kSide) {
    return fail(ErrorCode::kInvalid, "a light map of " + size_text(width, height) +
                                         " texels; sides are 1 to " + std::to_string(kSide));
  }
  if (every != 1 && every != 2)
    return fail(ErrorCode::kInvalid,
                "every texel or every second one is composited, not " + std::to_string(every));
  const std::size_t texels =
      static_cast<std::size_t>(out_width()) * static_cast<std::size_t>(out_height());
  if (out.size() != 3 * texels) {
    return fail(ErrorCode::kInvalid, "the output has " + std::to_string(out.size()) + " floats; " +
                                         size_text(out_width(), out_height()) + " texels need " +
                                         std::to_string(3 * texels));
  }
  RELIT_TRY(check_light(*this));
  for (const CompositePrediction& prediction : predictions)
    RELIT_TRY(check_prediction(prediction, planes.size(), texels));
  for (std::size_t k = 0; k < planes.size(); ++k) {
    const bool predicts = std::any_of(predictions.begin(), predictions.end(), [&](const auto& p) {
      return p.plane == static_cast<int>(k);
    });
    if (is_zero(light.weights[k]) && !(predicts && !planes[k].mantissa.empty())) continue;
    RELIT_TRY(check_plane(planes[k], *this, k));
    for (float weight : light.weights[k]) {
      if (!std::isfinite(weight * planes[k].scale)) {
        return fail(ErrorCode::kInvalid, plane_name(k) + ": weight times scale is not finite");
      }
    }
  }
  return {};
}

void CompositeJob::run() const { composite_kernels().back().run(*this); }

void CompositeJob::run_scalar() const { composite_scalar(*this); }

}  // namespace relit::decoders
