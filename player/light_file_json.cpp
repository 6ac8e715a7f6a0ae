// SPDX-License-Identifier: MIT
#include <array>
#include <cfloat>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "container/base/out_of_memory.hpp"
#include "player/light.hpp"
#include "player/light_field.hpp"
#include "player/light_file.hpp"

namespace relit::player {
namespace {

using nlohmann::json;

// {"keys": [{"sh": [[[r]]]}]}: what is nested more deeply is not kept.
constexpr int kDepth = 7;

std::string element(const std::string& array, std::size_t index) {
  return array + "[" + std::to_string(index) + "]";
}

Result<double> read_number(const json& value, const std::string& place) {
  if (!value.is_number()) return fail(ErrorCode::kInvalid, place + " is not a number");
  const auto number = value.get<double>();
  if (!(std::abs(number) <= static_cast<double>(FLT_MAX))) {
    return fail(ErrorCode::kInvalid, place + " is beyond the range of float, 3.4e38");
  }
  return number;
}

Result<double> read_member(const json& object, const char* name, const std::string& place) {
  if (!object.is_object() || !object.contains(name))
    return fail(ErrorCode::kInvalid, place + " has no \"" + name + "\"");
  return read_number(object[name], place + "." + name);
}

Result<std::array<double, 3>> read_triple(const json& object, const char* name) {
  const std::string place = std::string("probes.") + name;
  if (!object.contains(name) || !object[name].is_array() || object[name].size() != 3)
    return fail(ErrorCode::kInvalid, place + " is not three numbers [x,y,z]");
  std::array<double, 3> triple{};
  for (std::size_t i = 0; i < 3; ++i) {
    RELIT_ASSIGN(triple[i], read_number(object[name][i], element(place, i)));
  }
  return triple;
}

Result<decoders::Light> read_rows(const json& rows, const std::string& place) {
  if (!rows.is_array()) return fail(ErrorCode::kInvalid, place + " is not a light, [[r,g,b], …]");
  decoders::Light light;
  for (std::size_t n = 0; n < rows.size() && n < 16; ++n) {
    if (!rows[n].is_array() || rows[n].size() != 3) {
      return fail(ErrorCode::kInvalid, element(place, n) + " is not three numbers [r,g,b]");
    }
    std::array<double, 3> row{};
    for (std::size_t c = 0; c < 3; ++c) {
      RELIT_ASSIGN(row[c], read_number(rows[n][c], element(element(place, n), c)));
    }
    light.sh.push_back(row);
  }
  if (light.order() < 0 || rows.size() != light.sh.size()) {
    return fail(ErrorCode::kInvalid, "\"" + place + "\" has " + std::to_string(rows.size()) +
                                         " rows; a light has 1, 4, 9 or 16");
  }
  return light;
}

/// Reads what is called "sh": a light, or one for each probe where there is a grid.
Status read_lights(const json& owner, bool grid, const std::string& place, LightFieldParts& parts) {
  const std::string inner = place.empty() ? "sh" : place + ".sh";
  if (!owner.is_object() || !owner.contains("sh") || !owner["sh"].is_array()) {
    return fail(ErrorCode::kInvalid,
                (place.empty() ? std::string() : place + " has ") +
                    "no array \"sh\"; a light is {\"sh\": [[r,g,b], …]}, or has \"keys\" or "
                    "\"probes\"");
  }
  const json& sh = owner["sh"];
  const std::size_t probes = parts.grid.count();
  if (grid && sh.size() != probes) {
    return fail(ErrorCode::kInvalid, inner + " has " + std::to_string(sh.size()) +
                                         " lights; the grid has " + std::to_string(probes) +
                                         " probes");
  }
  for (std::size_t i = 0; i < (grid ? probes : 1); ++i) {
    const std::string name = grid ? element(inner, i) : inner;
    RELIT_ASSIGN(decoders::Light light, read_rows(grid ? sh[i] : sh, name));
    if (!parts.lights.empty() && parts.lights[0].sh.size() != light.sh.size()) {
      return fail(ErrorCode::kInvalid, "\"" + name + "\" has " + std::to_string(light.sh.size()) +
                                           " rows, and the first light " +
                                           std::to_string(parts.lights[0].sh.size()));
    }
    parts.lights.push_back(std::move(light));
  }
  return {};
}

Result<ProbeGrid> read_grid(const json& probes) {
  if (!probes.is_object()) return fail(ErrorCode::kInvalid, "\"probes\" is not an object");
  ProbeGrid grid;
  RELIT_ASSIGN(grid.origin, read_triple(probes, "origin"));
  RELIT_ASSIGN(grid.spacing, read_triple(probes, "spacing"));
  RELIT_ASSIGN(const auto size, read_triple(probes, "size"));
  std::size_t count = 1;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!(size[i] >= 1) || size[i] != std::floor(size[i])) {
      return fail(ErrorCode::kInvalid, element("probes.size", i) + " is not a number of probes");
    }
    constexpr auto kMost = static_cast<double>(LightField::kMostProbes);
    if (size[i] * static_cast<double>(count) > kMost) {
      return fail(ErrorCode::kLimit,
                  "probes.size: more than " + std::to_string(LightField::kMostProbes) + " probes");
    }
    grid.size[i] = static_cast<int>(size[i]);
    count *= static_cast<std::size_t>(size[i]);
  }
  return grid;
}

Status read_keys(const json& document, bool grid, LightFieldParts& parts) {
  const json& keys = document["keys"];
  if (!keys.is_array() || keys.empty())
    return fail(ErrorCode::kInvalid, "\"keys\" is not an array of at least one key");
  if (document.contains("sh") || (grid && document["probes"].contains("sh"))) {
    return fail(ErrorCode::kInvalid, "\"sh\" beside \"keys\"; it belongs into each key");
  }
  if (keys.size() > LightField::kMostKeys ||
      keys.size() * parts.grid.count() > LightField::kMostLights) {
    return fail(ErrorCode::kLimit,
                std::to_string(keys.size()) + " keys of " + std::to_string(parts.grid.count()) +
                    " lights; there may be " + std::to_string(LightField::kMostKeys) +
                    " keys and " + std::to_string(LightField::kMostLights) + " lights");
  }
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const std::string place = element("keys", i);
    RELIT_ASSIGN(const double time_s, read_member(keys[i], "time_s", place));
    parts.times_s.push_back(time_s);
    RELIT_TRY(read_lights(keys[i], grid, place, parts));
  }
  if (document.contains("loop")) {
    if (!document["loop"].is_boolean())
      return fail(ErrorCode::kInvalid, "\"loop\" is neither true nor false");
    parts.loop = document["loop"].get<bool>();
  }
  if (document.contains("interpolation")) {
    const json& kind = document["interpolation"];
    if (kind != "linear" && kind != "step")
      return fail(ErrorCode::kInvalid, "\"interpolation\" is neither \"linear\" nor \"step\"");
    parts.step = kind == "step";
  }
  if (document.contains("period_s")) {
    RELIT_ASSIGN(parts.period_s, read_number(document["period_s"], "period_s"));
  }
  return {};
}

Result<LightField> from_json(const json& document) {
  LightFieldParts parts;
  const bool grid = document.is_object() && document.contains("probes");
  if (grid) {
    RELIT_ASSIGN(parts.grid, read_grid(document["probes"]));
  }
  if (document.is_object() && document.contains("keys")) {
    RELIT_TRY(read_keys(document, grid, parts));
  } else if (grid) {
    if (document.contains("sh"))
      return fail(ErrorCode::kInvalid, "\"sh\" beside \"probes\"; it belongs into them");
    RELIT_TRY(read_lights(document["probes"], true, "probes", parts));
  } else {
    RELIT_TRY(read_lights(document, false, "", parts));
  }
  return LightField::create(std::move(parts));
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

std::string triple(const std::array<double, 3>& values) {
  return "[" + digits(values[0]) + ", " + digits(values[1]) + ", " + digits(values[2]) + "]";
}

std::string rows_json(const decoders::Light& light, const std::string& indent) {
  std::string text = "[";
  for (std::size_t n = 0; n < light.sh.size(); ++n)
    text += (n == 0 ? "\n" : ",\n") + indent + triple(light.sh[n]);
  return text + "]";
}

/// "sh" of a key: a light, or one for each probe.
std::string lights_json(std::span<const decoders::Light> lights, bool grid) {
  if (!grid) return rows_json(lights[0], "   ");
  std::string text = "[";
  for (std::size_t i = 0; i < lights.size(); ++i)
    text += (i == 0 ? "" : ",") + rows_json(lights[i], "   ");
  return text + "]";
}

}  // namespace

Result<LightField> read_light_field(std::span<const std::uint8_t> bytes) {
  return catch_out_of_memory("reading a light", [&]() -> Result<LightField> {
    try {
      const auto shallow = [](int depth, json::parse_event_t, const json&) {
        return depth <= kDepth;
      };
      return from_json(json::parse(bytes.begin(), bytes.end(), shallow));
    } catch (const json::exception& error) {
      return fail(ErrorCode::kCorrupt, std::string("not JSON: ") + error.what());
    }
  });
}

Result<std::string> light_json(const decoders::Light& light) {
  if (light.order() < 0) {
    return fail(ErrorCode::kInvalid,
                "a light has 1, 4, 9 or 16 coefficients, not " + std::to_string(light.sh.size()));
  }
  for (std::size_t n = 0; n < light.sh.size(); ++n) {
    for (std::size_t c = 0; c < 3; ++c) {
      if (!std::isfinite(light.sh[n][c])) {
        return fail(ErrorCode::kInvalid,
                    element(element("sh", n), c) + " of the light is not finite");
      }
    }
  }
  std::string rows = rows_json(light, "  ");
  rows.insert(rows.size() - 1, "\n");
  return "{\"sh\": " + rows + "}\n";
}

std::string light_field_json(const LightField& field) {
  const LightFieldParts& parts = field.parts();
  const bool keys = !parts.times_s.empty(), grid = parts.grid != ProbeGrid{};
  if (!keys && !grid) return *light_json(parts.lights[0]);
  std::string text = "{";
  const std::span<const decoders::Light> lights(parts.lights);
  if (grid) {
    const auto& size = parts.grid.size;
    text += "\"probes\": {\"origin\": " + triple(parts.grid.origin) +
            ", \"spacing\": " + triple(parts.grid.spacing) + ", \"size\": [" +
            std::to_string(size[0]) + ", " + std::to_string(size[1]) + ", " +
            std::to_string(size[2]) + "]";
    if (!keys) return text + ",\n \"sh\": " + lights_json(lights, true) + "}}\n";
    text += "},\n ";
  }
  text += std::string("\"loop\": ") + (parts.loop ? "true" : "false") +
          ", \"interpolation\": " + (parts.step ? "\"step\"" : "\"linear\"");
  if (parts.period_s > 0) text += ", \"period_s\": " + digits(parts.period_s);
  text += ",\n \"keys\": [";
  for (std::size_t i = 0; i < parts.times_s.size(); ++i) {
    text += (i == 0 ? "\n" : ",\n") + std::string("  {\"time_s\": ") + digits(parts.times_s[i]) +
            ", \"sh\": " +
            lights_json(lights.subspan(i * parts.grid.count(), parts.grid.count()), grid) + "}";
  }
  return text + "\n ]}\n";
}

}  // namespace relit::player
