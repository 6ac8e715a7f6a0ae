// SPDX-License-Identifier: MIT
#include <array>
#include <cfloat>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "player/light.hpp"
#include "player/light_file.hpp"

namespace relit::player {
namespace {

using nlohmann::json;

std::string place(std::size_t row, std::size_t column) {
  return "sh[" + std::to_string(row) + "][" + std::to_string(column) + "]";
}

Result<decoders::Light> from_json(const json& document) {
  if (!document.is_object() || !document.contains("sh") || !document["sh"].is_array()) {
    return fail(ErrorCode::kInvalid, "no array \"sh\"; a light is {\"sh\": [[r,g,b], …]}");
  }
  const json& rows = document["sh"];
  decoders::Light light;
  for (std::size_t n = 0; n < rows.size() && n < 16; ++n) {
    if (!rows[n].is_array() || rows[n].size() != 3) {
      return fail(ErrorCode::kInvalid,
                  "sh[" + std::to_string(n) + "] is not three numbers [r,g,b]");
    }
    std::array<double, 3> row{};
    for (std::size_t c = 0; c < 3; ++c) {
      if (!rows[n][c].is_number())
        return fail(ErrorCode::kInvalid, place(n, c) + " is not a number");
      row[c] = rows[n][c].get<double>();
      if (!(std::abs(row[c]) <= static_cast<double>(FLT_MAX))) {
        return fail(ErrorCode::kInvalid, place(n, c) + " is beyond the range of float, 3.4e38");
      }
    }
    light.sh.push_back(row);
  }
  if (light.order() < 0 || rows.size() != light.sh.size()) {
    return fail(ErrorCode::kInvalid,
                "\"sh\" has " + std::to_string(rows.size()) + " rows; a light has 1, 4, 9 or 16");
  }
  return light;
}

/// The shortest digits that give the same double again, always with a point or an exponent: -0 as
/// an integer would lose its sign.
std::string digits(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  std::string result(text.data(), end);
  if (result.find_first_of(".e") == std::string::npos) result += ".0";
  return result;
}

}  // namespace

Result<decoders::Light> read_light_json(std::span<const std::uint8_t> bytes) {
  try {
    return from_json(json::parse(bytes.begin(), bytes.end()));
  } catch (const json::exception& error) {
    return fail(ErrorCode::kCorrupt, std::string("not JSON: ") + error.what());
  }
}

Result<std::string> light_json(const decoders::Light& light) {
  if (light.order() < 0) {
    return fail(ErrorCode::kInvalid,
                "a light has 1, 4, 9 or 16 coefficients, not " + std::to_string(light.sh.size()));
  }
  std::string text = "{\"sh\": [";
  for (std::size_t n = 0; n < light.sh.size(); ++n) {
    text += n == 0 ? "\n  [" : ",\n  [";
    for (std::size_t c = 0; c < 3; ++c) {
      if (!std::isfinite(light.sh[n][c])) {
        return fail(ErrorCode::kInvalid, place(n, c) + " of the light is not finite");
      }
      if (c > 0) text += ", ";
      text += digits(light.sh[n][c]);
    }
    text += "]";
  }
  return text + "\n]}\n";
}

}  // namespace relit::player
