// SPDX-License-Identifier: MIT
#include <string>

#include "decoders/bit_reader.hpp"
#include "decoders/sequence_header.hpp"

namespace relit::decoders {
namespace {

struct Level {
  std::uint32_t index = 0;
  bool high_tier = false;
};

/// uvlc() of the AV1 specification, 4.10.3.
void skip_uvlc(BitReader& r) {
  int zeros = 0;
  while (!r.failed() && !r.flag()) ++zeros;
  if (zeros < 32) r.skip(zeros);
}

/// Returns buffer_delay_length, or 0 without a decoder model.
int read_timing(BitReader& r) {
  if (!r.flag()) return 0;
  r.skip(32);
  r.skip(32);
  if (r.flag()) skip_uvlc(r);
  if (!r.flag()) return 0;
  const int delay_bits = static_cast<int>(r.bits(5)) + 1;
  r.skip(32);
  r.skip(10);
  return delay_bits;
}

/// Timing and operating points, of which the first one's level is returned.
Level read_operating_points(BitReader& r) {
  const int delay_bits = read_timing(r);
  const bool display_delay = r.flag();
  const std::uint32_t points = r.bits(5) + 1;
  Level first;
  for (std::uint32_t i = 0; i < points && !r.failed(); ++i) {
    r.skip(12);
    Level level{r.bits(5), false};
    if (level.index > 7) level.high_tier = r.flag();
    if (delay_bits > 0 && r.flag()) {
      r.skip(delay_bits);
      r.skip(delay_bits);
      r.skip(1);
    }
    if (display_delay && r.flag()) r.skip(4);
    if (i == 0) first = level;
  }
  return first;
}

/// From frame_width_bits_minus_1 to enable_restoration.
void skip_frame_tools(BitReader& r, bool reduced) {
  const int width_bits = static_cast<int>(r.bits(4)) + 1;
  const int height_bits = static_cast<int>(r.bits(4)) + 1;
  r.skip(width_bits);
  r.skip(height_bits);
  if (!reduced && r.flag()) r.skip(7);  // frame ids
  r.skip(3);
  if (!reduced) {
    r.skip(4);
    const bool order_hint = r.flag();
    if (order_hint) r.skip(2);
    const bool chosen_by_frame = r.flag();
    const bool screen_content = chosen_by_frame || r.flag();
    // seq_choose_integer_mv, else seq_force_integer_mv
    if (screen_content && !r.flag()) r.skip(1);
    if (order_hint) r.skip(3);
  }
  r.skip(3);
}

/// color_config(), 5.5.2, as the third byte of the record without the tier.
std::uint32_t read_color(BitReader& r, std::uint32_t profile) {
  constexpr std::uint32_t kIdentityOfSrgb = (1u << 16) | (13u << 8);
  const bool high = r.flag();
  const bool twelve = profile == 2 && high && r.flag();
  const bool mono = profile != 1 && r.flag();
  const std::uint32_t description = r.flag() ? r.bits(24) : 0x020202;
  std::uint32_t x = 1, y = 1, position = 0;
  if (!mono && description == kIdentityOfSrgb) {
    x = y = 0;
  } else {
    r.skip(1);  // color_range
    if (!mono && profile == 1) x = y = 0;
    if (!mono && profile == 2) {
      x = twelve ? r.bits(1) : 1;
      y = twelve && x == 1 ? r.bits(1) : 0;
    }
    if (!mono && x == 1 && y == 1) position = r.bits(2);
  }
  return (high ? 0x40u : 0u) | (twelve ? 0x20u : 0u) | (mono ? 0x10u : 0u) | (x << 3) | (y << 2) |
         position;
}

}  // namespace

Result<std::array<std::uint8_t, 4>> av1_configuration(std::span<const std::uint8_t> payload) {
  BitReader r(payload);
  const std::uint32_t profile = r.bits(3);
  r.skip(1);
  const bool reduced = r.flag();
  Level level;
  if (reduced) {
    level.index = r.bits(5);
  } else {
    level = read_operating_points(r);
  }
  skip_frame_tools(r, reduced);
  const std::uint32_t color = read_color(r, profile);
  if (r.failed() || profile > 2) {
    return fail(ErrorCode::kCorrupt,
                "AV1 sequence header: it ends early, or its profile is not 0 to 2");
  }
  return std::array<std::uint8_t, 4>{
      0x81, static_cast<std::uint8_t>((profile << 5) | level.index),
      static_cast<std::uint8_t>((level.high_tier ? 0x80u : 0u) | color), 0};
}

}  // namespace relit::decoders
