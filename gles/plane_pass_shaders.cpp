// SPDX-License-Identifier: MIT
#include <algorithm>
#include <bit>
#include <cstdio>

#include "gles/plane_pass.hpp"
#include "gles/prediction.hpp"
#include "gles/shaders.hpp"

namespace relit::gles {
namespace {

constexpr const char* kHarmonicNames[kHarmonics] = {"HARMONIC_0", "HARMONIC_1", "HARMONIC_2",
                                                    "HARMONIC_3", "HARMONIC_4", "HARMONIC_5",
                                                    "HARMONIC_6", "HARMONIC_7", "HARMONIC_8"};

constexpr const char* kBatchNames[] = {"BATCH_WEIGHTS", "BATCH_PLANES",   "BATCH_MANTISSA",
                                       "BATCH_SHEET_0", "BATCH_SHEET_1",  "BATCH_SHEET_2",
                                       "BATCH_SHEET_3", "BATCH_EXPONENTS"};

std::string define(const std::string& name, const std::string& value) {
  return "#define " + name + " " + value + "\n";
}

std::string undefine(const std::string& name) { return "#undef " + name + "\n"; }

std::string channel_names(unsigned channels) {
  std::string names;
  for (unsigned c = 0; c < 3; ++c)
    if ((channels >> c & 1u) != 0) names += "rgb"[c];
  return names.empty() ? "r" : names;
}

constexpr const char* kWeightNames[] = {"WEIGHT_0", "WEIGHT_1", "WEIGHT_2", "REFERENCE"};

std::string weights_name(std::size_t batch) { return "u_weight" + std::to_string(batch); }

// Ten digits tell any two floats apart.
std::string vector_of(const std::array<float, 4>& v) {
  char text[96];
  std::snprintf(text, sizeof text, "vec4(%.9e, %.9e, %.9e, %.9e)", static_cast<double>(v[0]),
                static_cast<double>(v[1]), static_cast<double>(v[2]), static_cast<double>(v[3]));
  return text;
}

}  // namespace

std::string PlanePass::sheet_name(int sheet) const {
  const auto unit = std::find(sheets_.begin(), sheets_.end(), sheet) - sheets_.begin();
  return "u_sheet" + std::to_string(unit);
}

std::string PlanePass::samplers() const {
  std::string text;
  for (int unit = 0; unit < unit_count(); ++unit)
    text += "uniform sampler2D u_sheet" + std::to_string(unit) + ";\n";
  if constexpr (std::endian::native == std::endian::big) text += define("BIG_ENDIAN", "1");
  return text + std::string(shaders::composite_head);
}

std::string PlanePass::weights_text(std::size_t index, int groups) const {
  return "uniform vec4 " + weights_name(index) + "[" +
         std::to_string(groups * batches_[index].vectors()) + "];\n";
}

std::string PlanePass::batch_names(std::size_t index) const {
  const Batch& batch = batches_[index];
  std::string text = define("BATCH_PLANES", std::to_string(batch.planes_per_group));
  text += define("BATCH_WEIGHTS", weights_name(index));
  text += define("BATCH_MANTISSA",
                 std::string(is_raw(batch) ? "raw" : "mantissa") + (batch.wide ? "10" : "8"));
  for (int i = 0; i < batch.planes_per_group; ++i)
    text += define("BATCH_SHEET_" + std::to_string(i),
                   sheet_name(batch.sheets[static_cast<std::size_t>(i)]));
  if (batch.exponent_sheet >= 0)
    text += define("BATCH_EXPONENTS", sheet_name(batch.exponent_sheet));
  return text;
}

std::string PlanePass::place_text(const Group& group, const Batch& batch, int lookup,
                                  const PlaneSheets& sheets) {
  const bool exponent = lookup == batch.planes_per_group;
  const std::size_t k = plane_of(group, exponent ? 0 : lookup);
  return vector_of(sheets.coordinates(exponent ? sheets.exponent(k) : sheets.mantissa(k)));
}

// What a group's statements call its weights, each of its plane's channels, and E_ref, which is the
// fourth number of the first weight.
std::string PlanePass::weight_names(std::size_t index, int group, FlatWeights* flat) const {
  const Batch& batch = batches_[index];
  const auto number = [&](int slot, char channel) {
    const std::string uniform = weights_name(index) + "[" +
                                std::to_string(group * batch.planes_per_group + slot) + "]." +
                                channel;
    return flat != nullptr ? flat->name(uniform) : uniform;
  };
  std::string text;
  for (int i = 0; i < batch.planes_per_group; ++i) {
    const auto slot = static_cast<std::size_t>(i);
    const std::string channels =
        channel_names(batch.groups[static_cast<std::size_t>(group)].channels[slot]);
    std::string weight;
    for (const char channel : channels) weight += (weight.empty() ? "" : ", ") + number(i, channel);
    if (channels.size() > 1) weight = "vec" + std::to_string(channels.size()) + "(" + weight + ")";
    text += define(kWeightNames[slot], weight);
  }
  if (batch.exponent_sheet >= 0) text += define("REFERENCE", number(0, 'a'));
  return text;
}

// The same for a prediction's nine.
std::string PlanePass::harmonic_names(std::size_t index, FlatWeights* flat) const {
  std::string text;
  for (std::size_t n = 0; n < kHarmonics; ++n) {
    const std::string weight = weights_name(index) + "[" + std::to_string(n) + "]";
    std::string numbers;
    for (const char channel : {'r', 'g', 'b'}) {
      const std::string uniform = weight + "." + channel;
      numbers += (numbers.empty() ? "" : ", ") + (flat != nullptr ? flat->name(uniform) : uniform);
    }
    text += define(kHarmonicNames[n], flat != nullptr ? "vec3(" + numbers + ")" : weight);
  }
  return text;
}

std::string PlanePass::weight_declarations(std::span<const int> counts) const {
  std::string text;
  for (std::size_t b = 0; b < batches_.size(); ++b)
    if (counts[b] > 0) text += weights_text(b, counts[b]);
  return text;
}

std::string PlanePass::text(PlaneTaps taps, std::span<const int> counts, const PlaneSheets& sheets,
                            FlatWeights* flat) const {
  std::string text = samplers();
  if (taps == PlaneTaps::kFour) text += define("FOUR_TAPS", "1");
  text += shaders::composite_taps;
  std::string sums;
  for (std::size_t b = 0; b < batches_.size(); ++b) {
    const Batch& batch = batches_[b];
    if (counts[b] == 0) continue;
    const std::string name = "sum" + std::to_string(b) + "()";
    text += weights_text(b, counts[b]) + batch_names(b);
    text += "vec3 " + name + " {\n  vec3 sum = vec3(0.0);\n  vec2 low, high;\n";
    for (int g = 0; g < counts[b]; ++g) {
      std::string names = define("GROUP", std::to_string(g)), after = undefine("GROUP");
      names += batch.predicts ? harmonic_names(b, flat) : weight_names(b, g, flat);
      for (const char* each : kWeightNames) after += undefine(each);
      for (const char* each : kHarmonicNames) after += undefine(each);
      for (int i = 0; i < batch.lookups(); ++i) {
        const std::string place =
            i == batch.planes_per_group ? "PLACE_E" : "PLACE_" + std::to_string(i);
        names +=
            define(place, place_text(batch.groups[static_cast<std::size_t>(g)], batch, i, sheets));
        after += undefine(place);
      }
      for (std::size_t i = 0; i < 3; ++i) {
        const std::string channels = "CHANNELS_" + std::to_string(i);
        names +=
            define(channels, channel_names(batch.groups[static_cast<std::size_t>(g)].channels[i]));
        after += undefine(channels);
      }
      text += names;
      text += batch.predicts ? shaders::composite_predict : shaders::composite_group;
      text += after;
    }
    text += "  return sum;\n}\n";
    for (const char* each : kBatchNames) text += undefine(each);
    sums += " + " + name;
  }
  return text + "vec3 plane_sum() { return u_constant" + sums + "; }\n";
}

PlanePass::LookupText PlanePass::lookup_text(const PlaneSheets& sheets) const {
  LookupText text;
  text.uniforms = samplers();
  std::size_t varying = 0;
  for (std::size_t b = 0; b < batches_.size(); ++b) {
    const Batch& batch = batches_[b];
    text.uniforms += weights_text(b, batch.count());
    text.statements += batch_names(b);
    for (int g = 0; g < batch.count(); ++g) {
      std::string names = define("GROUP", std::to_string(g)), after = undefine("GROUP");
      if (batch.predicts) names += harmonic_names(b, nullptr);
      for (const char* each : kHarmonicNames) after += undefine(each);
      for (int i = 0; i < batch.lookups(); ++i) {
        const std::string v = "v" + std::to_string(varying++);
        const std::string name =
            i == batch.planes_per_group ? "GROUP_UV_E" : "GROUP_UV_" + std::to_string(i);
        const std::string place =
            place_text(batch.groups[static_cast<std::size_t>(g)], batch, i, sheets);
        text.varyings += "VARYING vec2 " + v + ";\n";
        text.assignments += "  " + v + " = " + place + ".xy + texel * " + place + ".zw;\n";
        names += define(name, v);
        after += undefine(name);
      }
      text.statements += names;
      text.statements += batch.predicts ? shaders::composite_predict : shaders::composite_unrolled;
      text.statements += after;
    }
    for (const char* each : kBatchNames) text.statements += undefine(each);
  }
  return text;
}

}  // namespace relit::gles
