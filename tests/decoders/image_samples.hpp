// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

/// Small pictures made byte by byte, so that tests know every texel.
namespace relit::test {

using Bytes = std::vector<std::uint8_t>;

inline void append_be32(Bytes& out, std::uint32_t v) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<std::uint8_t>(v >> shift));
}

inline std::uint32_t crc32(std::span<const std::uint8_t> bytes) {
  std::uint32_t crc = ~0u;
  for (const std::uint8_t b : bytes) {
    crc ^= b;
    for (int k = 0; k < 8; ++k) crc = (crc >> 1) ^ ((crc & 1u) != 0 ? 0xEDB88320u : 0u);
  }
  return ~crc;
}

inline void append_png_chunk(Bytes& out, std::string_view type, const Bytes& data) {
  append_be32(out, static_cast<std::uint32_t>(data.size()));
  Bytes body(type.begin(), type.end());
  body.insert(body.end(), data.begin(), data.end());
  out.insert(out.end(), body.begin(), body.end());
  append_be32(out, crc32(body));
}

/// zlib with one stored block; at most 65535 bytes.
inline Bytes zlib_stored(const Bytes& data) {
  const auto length = static_cast<std::uint16_t>(data.size());
  Bytes out{0x78,
            0x01,
            0x01,
            static_cast<std::uint8_t>(length & 0xff),
            static_cast<std::uint8_t>(length >> 8),
            static_cast<std::uint8_t>(~length & 0xff),
            static_cast<std::uint8_t>((~length >> 8) & 0xff)};
  out.insert(out.end(), data.begin(), data.end());
  std::uint32_t a = 1, b = 0;
  for (const std::uint8_t v : data) {
    a = (a + v) % 65521;
    b = (b + a) % 65521;
  }
  append_be32(out, b << 16 | a);
  return out;
}

struct PngSpec {
  int width = 1;
  int height = 1;
  int bit_depth = 8;
  int color_type = 6;  ///< 0 grey, 2 RGB, 3 palette, 4 grey and alpha, 6 RGBA
  Bytes rows;          ///< packed rows without filter bytes
  Bytes palette;       ///< RGB triples
  Bytes transparency;  ///< tRNS
};

inline Bytes make_png(const PngSpec& spec) {
  Bytes png{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  Bytes header;
  append_be32(header, static_cast<std::uint32_t>(spec.width));
  append_be32(header, static_cast<std::uint32_t>(spec.height));
  for (const int v : {spec.bit_depth, spec.color_type, 0, 0, 0}) {
    header.push_back(static_cast<std::uint8_t>(v));
  }
  append_png_chunk(png, "IHDR", header);
  if (!spec.palette.empty()) append_png_chunk(png, "PLTE", spec.palette);
  if (!spec.transparency.empty()) append_png_chunk(png, "tRNS", spec.transparency);
  Bytes filtered;
  const std::size_t row_bytes = spec.rows.size() / static_cast<std::size_t>(spec.height);
  for (std::size_t y = 0; y < static_cast<std::size_t>(spec.height); ++y) {
    filtered.push_back(0);
    const auto row = spec.rows.begin() + static_cast<std::ptrdiff_t>(y * row_bytes);
    filtered.insert(filtered.end(), row, row + static_cast<std::ptrdiff_t>(row_bytes));
  }
  append_png_chunk(png, "IDAT", zlib_stored(filtered));
  append_png_chunk(png, "IEND", {});
  return png;
}

inline Bytes make_rgba_png(int width, int height, const Bytes& rgba) {
  return make_png({width, height, 8, 6, rgba, {}, {}});
}

/// A baseline JPEG of one 8×8 block whose components (1 grey, 3 YCbCr, 4 CMYK) have the values
/// given.
inline Bytes make_flat_jpeg(const std::vector<int>& components) {
  const auto count = static_cast<std::uint8_t>(components.size());
  Bytes out{0xff, 0xd8, 0xff, 0xdb, 0, 67, 0};
  out.insert(out.end(), 64, 1);  // quantisation by 1
  out.insert(out.end(),
             {0xff, 0xc0, 0, static_cast<std::uint8_t>(8 + 3 * count), 8, 0, 8, 0, 8, count});
  for (std::uint8_t c = 0; c < count; ++c) {
    out.insert(out.end(), {static_cast<std::uint8_t>(c + 1), 0x11, 0});
  }
  // DC: categories 0..11, each with 4 bits. AC: "end of block" alone, one bit.
  out.insert(out.end(), {0xff, 0xc4, 0, 31, 0x00, 0, 0, 0, 12, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  for (std::uint8_t category = 0; category < 12; ++category) out.push_back(category);
  out.insert(out.end(),
             {0xff, 0xc4, 0, 20, 0x10, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  out.insert(out.end(), {0xff, 0xda, 0, static_cast<std::uint8_t>(6 + 2 * count), count});
  for (std::uint8_t c = 0; c < count; ++c) {
    out.insert(out.end(), {static_cast<std::uint8_t>(c + 1), 0x00});
  }
  out.insert(out.end(), {0, 63, 0});
  std::vector<bool> bits;
  const auto put = [&](unsigned value, int width) {
    for (int b = width - 1; b >= 0; --b) bits.push_back((value >> b & 1u) != 0);
  };
  for (const int value : components) {
    const int dc = (value - 128) * 8;
    const unsigned magnitude = static_cast<unsigned>(dc < 0 ? -dc : dc);
    int category = 0;
    while (magnitude >> category != 0) ++category;
    put(static_cast<unsigned>(category), 4);
    put(dc < 0 ? ~magnitude : magnitude, category);
    put(0, 1);
  }
  while (bits.size() % 8 != 0) bits.push_back(true);
  for (std::size_t i = 0; i < bits.size(); i += 8) {
    unsigned byte = 0;
    for (std::size_t b = 0; b < 8; ++b) byte = byte << 1 | (bits[i + b] ? 1u : 0u);
    out.push_back(static_cast<std::uint8_t>(byte));
    if (byte == 0xff) out.push_back(0);
  }
  out.insert(out.end(), {0xff, 0xd9});
  return out;
}

}  // namespace relit::test
