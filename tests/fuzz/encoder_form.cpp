// SPDX-License-Identifier: MIT
#include "tests/fuzz/encoder_form.hpp"

namespace relit::fuzz {
namespace {

/// A number of so many bytes, the highest first.
std::size_t number(Cursor& in, int bytes) {
  std::size_t value = 0;
  for (int i = 0; i < bytes; ++i) value = value << 8 | in.u8();
  return value;
}

void append_unit(Bytes& out, Input unit) {
  out.insert(out.end(), {0, 0, 0, 1});
  out.insert(out.end(), unit.begin(), unit.end());
}

void append_sets(Bytes& out, Cursor& in, std::size_t count) {
  for (std::size_t i = 0; i < count && !in.empty(); ++i) append_unit(out, in.take(number(in, 2)));
}

}  // namespace

Bytes encoder_private(std::string_view codec, Input stored) {
  Cursor in(stored);
  Bytes out;
  if (codec == "h264") {
    in.take(5);
    append_sets(out, in, in.u8() & 31u);
    append_sets(out, in, in.u8());
  } else if (codec == "hevc") {
    in.take(22);
    for (std::size_t arrays = in.u8(); arrays > 0 && !in.empty(); --arrays) {
      in.take(1);
      append_sets(out, in, number(in, 2));
    }
  } else {
    return copy(codec == "av1" ? stored.subspan(std::min<std::size_t>(4, stored.size())) : stored);
  }
  return out;
}

Bytes encoder_packet(std::string_view codec, Input stored) {
  Bytes out;
  if (codec == "av1") out = {0x12, 0};  // a temporal delimiter
  if (codec != "h264" && codec != "hevc") {
    out.insert(out.end(), stored.begin(), stored.end());
    return out;
  }
  for (Cursor in(stored); !in.empty();) append_unit(out, in.take(number(in, 4)));
  return out;
}

}  // namespace relit::fuzz
