// SPDX-License-Identifier: MIT
#include "decoders/composite_kernels.hpp"

#if defined(__ARM_NEON)
#include <arm_neon.h>

#include "decoders/composite_kernel.hpp"

namespace relit::decoders {
namespace {

struct Neon {
  using F = float32x4_t;
  using I = int32x4_t;
  static constexpr int kLanes = 4;

  static F load(const float* p) { return vld1q_f32(p); }
  static void store(float* p, F v) { vst1q_f32(p, v); }
  static F set(float v) { return vdupq_n_f32(v); }
  static F add(F a, F b) { return vaddq_f32(a, b); }
  static F sub(F a, F b) { return vsubq_f32(a, b); }
  static F mul(F a, F b) { return vmulq_f32(a, b); }
  static I set_int(int v) { return vdupq_n_s32(v); }
  static I sub_int(I a, I b) { return vsubq_s32(a, b); }
  static F to_float(I v) { return vcvtq_f32_s32(v); }

  template <int kShift>
  static I load_samples(const std::uint8_t* p, std::uint8_t) {
    if constexpr (kShift < 0) {
      const uint16x4_t both = vreinterpret_u16_u8(vld1_u8(p));
      return vreinterpretq_s32_u32(vmovl_u16(vand_u16(both, vdup_n_u16(0xFF))));
    } else {
      return repeat_bytes<kShift>(p);
    }
  }
  template <int kShift>
  static I repeat_bytes(const std::uint8_t* p) {
    std::uint32_t bytes = 0;
    __builtin_memcpy(&bytes, p, kLanes >> kShift);
    uint8x8_t v = vreinterpret_u8_u32(vdup_n_u32(bytes));
    if constexpr (kShift == 1) v = vzip_u8(v, v).val[0];
    return vreinterpretq_s32_u32(vmovl_u16(vget_low_u16(vmovl_u8(v))));
  }
  template <int kShift>
  static I load_samples(const std::uint8_t* p, std::uint16_t) {
    if constexpr (kShift < 0) {
      const uint32x4_t both = vreinterpretq_u32_u8(vld1q_u8(p));
      return vreinterpretq_s32_u32(vandq_u32(both, vdupq_n_u32(0xFFFF)));
    } else {
      return repeat_words<kShift>(p);
    }
  }
  template <int kShift>
  static I repeat_words(const std::uint8_t* p) {
    std::uint64_t words = 0;
    __builtin_memcpy(&words, p, std::size_t{2 * kLanes} >> kShift);
    uint16x4_t v = vcreate_u16(words);
    if constexpr (kShift == 1) v = vzip_u16(v, v).val[0];
    return vreinterpretq_s32_u32(vmovl_u16(v));
  }
  static F step(I e, int zero) {
    const I half = vshrq_n_s32(e, 1);
    const I low = vshlq_n_s32(vaddq_s32(half, vdupq_n_s32(63)), 23);
    const I rest = vaddq_s32(vsubq_s32(e, half), vdupq_n_s32(191 - zero));
    const F product =
        vmulq_f32(vreinterpretq_f32_s32(low), vreinterpretq_f32_s32(vshlq_n_s32(rest, 23)));
    const uint32x4_t is_zero = vceqq_s32(e, vdupq_n_s32(0));
    return vreinterpretq_f32_u32(vbicq_u32(vreinterpretq_u32_f32(product), is_zero));
  }
  static F saturate(F v) {
    const F most = vdupq_n_f32(FLT_MAX);
    const F least = vdupq_n_f32(-FLT_MAX);
    const F below =
        vbslq_f32(vcltq_f32(v, most), v, most);  // vminq would keep what is not a number
    return vbslq_f32(vcgtq_f32(below, least), below, least);
  }
  static void load_vectors(const float* p, F& x, F& y, F& z) {
    const float32x4x3_t v = vld3q_f32(p);
    x = v.val[0];
    y = v.val[1];
    z = v.val[2];
  }
};

}  // namespace

void composite_neon(const CompositeJob& job) { run_composite<Neon>(job); }

}  // namespace relit::decoders
#endif
