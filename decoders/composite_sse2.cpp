// SPDX-License-Identifier: MIT
#include "decoders/composite_kernels.hpp"

#if defined(__x86_64__)
#include <emmintrin.h>

#include "decoders/composite_kernel.hpp"

namespace relit::decoders {
namespace {

struct Sse2 {
  using F = __m128;
  using I = __m128i;
  static constexpr int kLanes = 4;

  static F load(const float* p) { return _mm_loadu_ps(p); }
  static void store(float* p, F v) { _mm_storeu_ps(p, v); }
  static F set(float v) { return _mm_set1_ps(v); }
  static F add(F a, F b) { return _mm_add_ps(a, b); }
  static F sub(F a, F b) { return _mm_sub_ps(a, b); }
  static F mul(F a, F b) { return _mm_mul_ps(a, b); }
  static I set_int(int v) { return _mm_set1_epi32(v); }
  static I sub_int(I a, I b) { return _mm_sub_epi32(a, b); }
  static F to_float(I v) { return _mm_cvtepi32_ps(v); }

  template <int kShift>
  static I load_samples(const std::uint8_t* p, std::uint8_t) {
    if constexpr (kShift < 0) {
      const I both = _mm_loadl_epi64(reinterpret_cast<const I*>(p));
      return _mm_unpacklo_epi16(_mm_and_si128(both, _mm_set1_epi16(0xFF)), _mm_setzero_si128());
    } else {
      return repeat_bytes<kShift>(p);
    }
  }
  template <int kShift>
  static I repeat_bytes(const std::uint8_t* p) {
    std::uint32_t bytes = 0;
    __builtin_memcpy(&bytes, p, kLanes >> kShift);
    I v = _mm_cvtsi32_si128(static_cast<int>(bytes));
    if constexpr (kShift == 1) v = _mm_unpacklo_epi8(v, v);
    const I zero = _mm_setzero_si128();
    return _mm_unpacklo_epi16(_mm_unpacklo_epi8(v, zero), zero);
  }
  template <int kShift>
  static I load_samples(const std::uint8_t* p, std::uint16_t) {
    if constexpr (kShift < 0) {
      const I both = _mm_loadu_si128(reinterpret_cast<const I*>(p));
      return _mm_and_si128(both, _mm_set1_epi32(0xFFFF));
    } else {
      return repeat_words<kShift>(p);
    }
  }
  template <int kShift>
  static I repeat_words(const std::uint8_t* p) {
    std::uint64_t words = 0;
    __builtin_memcpy(&words, p, std::size_t{2 * kLanes} >> kShift);
    I v = _mm_cvtsi64_si128(static_cast<long long>(words));
    if constexpr (kShift == 1) v = _mm_unpacklo_epi16(v, v);
    return _mm_unpacklo_epi16(v, _mm_setzero_si128());
  }
  static F step(I e, int zero) {
    const I half = _mm_srli_epi32(e, 1);
    const I low = _mm_slli_epi32(_mm_add_epi32(half, _mm_set1_epi32(63)), 23);
    const I rest = _mm_add_epi32(_mm_sub_epi32(e, half), _mm_set1_epi32(191 - zero));
    const F product = _mm_mul_ps(_mm_castsi128_ps(low), _mm_castsi128_ps(_mm_slli_epi32(rest, 23)));
    const I is_zero = _mm_cmpeq_epi32(e, _mm_setzero_si128());
    return _mm_andnot_ps(_mm_castsi128_ps(is_zero), product);
  }
  static F saturate(F v) {
    return _mm_max_ps(_mm_min_ps(v, _mm_set1_ps(FLT_MAX)), _mm_set1_ps(-FLT_MAX));
  }
  static void load_vectors(const float* p, F& x, F& y, F& z) {
    x = _mm_setr_ps(p[0], p[3], p[6], p[9]);
    y = _mm_setr_ps(p[1], p[4], p[7], p[10]);
    z = _mm_setr_ps(p[2], p[5], p[8], p[11]);
  }
};

}  // namespace

void composite_sse2(const CompositeJob& job) { run_composite<Sse2>(job); }

}  // namespace relit::decoders
#endif
