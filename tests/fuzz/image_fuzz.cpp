// SPDX-License-Identifier: MIT
#include <cstdint>

#include "decoders/image.hpp"
#include "tests/decoders/image_samples.hpp"
#include "tests/fuzz/fuzz.hpp"

/// Hostile pictures. With the first byte odd, the checksums of PNG chunks are made right.
namespace {

using namespace relit;
using namespace relit::fuzz;

std::uint64_t big_endian(Input bytes) {
  std::uint64_t value = 0;
  for (const std::uint8_t byte : bytes) value = value << 8 | byte;
  return value;
}

void mend_png(Bytes& png) {
  constexpr std::size_t kAround = 12;  // length, type, checksum
  for (std::size_t at = 8; at + kAround <= png.size();) {
    const std::uint64_t length = big_endian(Input(png).subspan(at, 4));
    if (length > png.size() - at - kAround) return;
    const auto bytes = static_cast<std::size_t>(length);
    const std::uint32_t crc = test::crc32(Input(png).subspan(at + 4, 4 + bytes));
    for (std::size_t i = 0; i < 4; ++i)
      png[at + 8 + bytes + i] = static_cast<std::uint8_t>(crc >> (24 - 8 * i));
    at += kAround + bytes;
  }
}

/// Pictures of many texels are slow to decode and nothing new.
bool is_large(Input bytes) {
  constexpr std::uint64_t kTexels = 1 << 18;
  if (decoders::image_media_type(bytes) == "image/png" && bytes.size() >= 24)
    return big_endian(bytes.subspan(16, 4)) * big_endian(bytes.subspan(20, 4)) > kTexels;
  for (std::size_t at = 0; at + 9 <= bytes.size(); ++at) {
    if (bytes[at] != 0xff || bytes[at + 1] < 0xc0 || bytes[at + 1] > 0xcf) continue;
    const auto size = bytes.subspan(at + 5, 4);
    if (big_endian(size.first(2)) * big_endian(size.last(2)) > kTexels) return true;
  }
  return false;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Cursor input({data, size});
  const bool mend = (input.u8() & 1) != 0;
  Bytes bytes = copy(input.rest());
  if (mend && decoders::image_media_type(bytes) == "image/png") mend_png(bytes);
  check(decoders::image_size(bytes));
  if (is_large(bytes)) return 0;
  const auto image = decoders::decode_image(bytes, "");
  if (!check(image)) return 0;
  require(image->width > 0 && image->height > 0);
  require(image->rgba.size() == std::size_t{4} * static_cast<unsigned>(image->width) *
                                    static_cast<unsigned>(image->height));
  return 0;
}
