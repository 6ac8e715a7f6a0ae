// SPDX-License-Identifier: MIT
#include "decoders/composite_kernels.hpp"

#if defined(__x86_64__)
#include <immintrin.h>

#define RELIT_KERNEL __attribute__((target("avx2")))
#include "decoders/composite_kernel.hpp"

namespace relit::decoders {
namespace {

struct Avx2 {
  using F = __m256;
  using I = __m256i;
  static constexpr int kLanes = 8;

  RELIT_KERNEL static F load(const float* p) { return _mm256_loadu_ps(p); }
  RELIT_KERNEL static void store(float* p, F v) { _mm256_storeu_ps(p, v); }
  RELIT_KERNEL static F set(float v) { return _mm256_set1_ps(v); }
  RELIT_KERNEL static F add(F a, F b) { return _mm256_add_ps(a, b); }
  RELIT_KERNEL static F sub(F a, F b) { return _mm256_sub_ps(a, b); }
  RELIT_KERNEL static F mul(F a, F b) { return _mm256_mul_ps(a, b); }
  RELIT_KERNEL static I set_int(int v) { return _mm256_set1_epi32(v); }
  RELIT_KERNEL static I sub_int(I a, I b) { return _mm256_sub_epi32(a, b); }
  RELIT_KERNEL static F to_float(I v) { return _mm256_cvtepi32_ps(v); }

  template <int kShift>
  RELIT_KERNEL static I load_samples(const std::uint8_t* p, std::uint8_t) {
    if constexpr (kShift < 0) {
      const __m128i both = _mm_loadu_si128(reinterpret_cast<const __m128i*>(p));
      return _mm256_cvtepu16_epi32(_mm_and_si128(both, _mm_set1_epi16(0xFF)));
    } else {
      return repeat_bytes<kShift>(p);
    }
  }
  template <int kShift>
  RELIT_KERNEL static I repeat_bytes(const std::uint8_t* p) {
    std::uint64_t bytes = 0;
    __builtin_memcpy(&bytes, p, kLanes >> kShift);
    __m128i v = _mm_cvtsi64_si128(static_cast<long long>(bytes));
    if constexpr (kShift >= 1) v = _mm_unpacklo_epi8(v, v);
    if constexpr (kShift == 2) v = _mm_unpacklo_epi16(v, v);
    return _mm256_cvtepu8_epi32(v);
  }
  template <int kShift>
  RELIT_KERNEL static I load_samples(const std::uint8_t* p, std::uint16_t) {
    if constexpr (kShift < 0) {
      const __m256i both = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p));
      return _mm256_and_si256(both, _mm256_set1_epi32(0xFFFF));
    } else if constexpr (kShift == 0) {
      return _mm256_cvtepu16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)));
    } else {
      const __m128i v = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(p));
      return _mm256_cvtepu16_epi32(_mm_unpacklo_epi16(v, v));
    }
  }
  RELIT_KERNEL static F step(I e, int zero) {
    const I half = _mm256_srli_epi32(e, 1);
    const I low = _mm256_slli_epi32(_mm256_add_epi32(half, _mm256_set1_epi32(63)), 23);
    const I rest = _mm256_add_epi32(_mm256_sub_epi32(e, half), _mm256_set1_epi32(191 - zero));
    const F product =
        _mm256_mul_ps(_mm256_castsi256_ps(low), _mm256_castsi256_ps(_mm256_slli_epi32(rest, 23)));
    const I is_zero = _mm256_cmpeq_epi32(e, _mm256_setzero_si256());
    return _mm256_andnot_ps(_mm256_castsi256_ps(is_zero), product);
  }
  RELIT_KERNEL static F saturate(F v) {
    return _mm256_max_ps(_mm256_min_ps(v, _mm256_set1_ps(FLT_MAX)), _mm256_set1_ps(-FLT_MAX));
  }
  RELIT_KERNEL static void load_vectors(const float* p, F& x, F& y, F& z) {
    const I index = _mm256_setr_epi32(0, 3, 6, 9, 12, 15, 18, 21);
    x = _mm256_i32gather_ps(p, index, 4);
    y = _mm256_i32gather_ps(p + 1, index, 4);
    z = _mm256_i32gather_ps(p + 2, index, 4);
  }
};

}  // namespace

RELIT_KERNEL void composite_avx2(const CompositeJob& job) { run_composite<Avx2>(job); }

}  // namespace relit::decoders
#endif
