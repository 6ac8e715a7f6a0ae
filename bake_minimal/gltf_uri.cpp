// SPDX-License-Identifier: MIT
#include "bake_minimal/gltf_uri.hpp"

#include <algorithm>

#include "bake_minimal/gltf_document.hpp"

namespace relit::bake::gltf {
namespace {

int base64_digit(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  if (c == '+' || c == '-') return 62;
  if (c == '/' || c == '_') return 63;
  return -1;
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

std::string percent_decoded(std::string_view uri) {
  std::string out;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] == '%' && i + 2 < uri.size()) {
      const int high = hex_digit(uri[i + 1]), low = hex_digit(uri[i + 2]);
      if (high >= 0 && low >= 0) {
        out += static_cast<char>(high * 16 + low);
        i += 2;
        continue;
      }
    }
    out += uri[i];
  }
  return out;
}

bool has_scheme(std::string_view uri) {
  const std::size_t colon = uri.find(':');
  return colon != std::string_view::npos && colon > 1 && uri.find('/') > colon;
}

std::string shortened(std::string_view uri) {
  return uri.size() <= 80 ? std::string(uri) : std::string(uri.substr(0, 77)) + "...";
}

}  // namespace

Result<std::vector<std::uint8_t>> decode_base64(std::string_view text) {
  std::size_t length = text.size();
  while (length > 0 && text.size() - length < 2 && text[length - 1] == '=') --length;
  if (length % 4 == 1 || (length != text.size() && text.size() % 4 != 0)) {
    return fail(ErrorCode::kCorrupt, "base64 of " + std::to_string(text.size()) +
                                         " characters is cut off; export the file again");
  }
  std::vector<std::uint8_t> out;
  out.reserve(length / 4 * 3 + 2);
  std::uint32_t bits = 0;
  int bit_count = 0;
  for (std::size_t i = 0; i < length; ++i) {
    const int digit = base64_digit(text[i]);
    if (digit < 0) {
      return fail(ErrorCode::kCorrupt,
                  "character " + std::to_string(i) + " is not base64; export the file again");
    }
    bits = bits << 6 | static_cast<std::uint32_t>(digit);
    bit_count += 6;
    if (bit_count >= 8) {
      bit_count -= 8;
      out.push_back(static_cast<std::uint8_t>(bits >> bit_count & 0xff));
    }
  }
  return out;
}

std::string_view data_uri_media_type(std::string_view uri) {
  if (!uri.starts_with("data:")) return {};
  return uri.substr(5, std::min(uri.find(';'), uri.find(',')) - 5);
}

Result<std::vector<std::uint8_t>> resolve_uri(std::string_view uri,
                                              const std::filesystem::path& directory) {
  if (uri.starts_with("data:")) {
    const std::size_t comma = uri.find(',');
    if (comma == std::string_view::npos || !uri.substr(0, comma).ends_with(";base64")) {
      return fail(ErrorCode::kUnsupported, "data URI \"" + shortened(uri) +
                                               "\" is not base64; write data:<type>;base64,<data>");
    }
    return decode_base64(uri.substr(comma + 1));
  }
  const std::filesystem::path relative(percent_decoded(uri));
  if (has_scheme(uri) || relative.is_absolute()) {
    return fail(ErrorCode::kUnsupported, "URI \"" + shortened(uri) +
                                             "\" is no relative path; put the file beside the glTF "
                                             "and name it relative to it");
  }
  return read_file(directory / relative);
}

}  // namespace relit::bake::gltf
