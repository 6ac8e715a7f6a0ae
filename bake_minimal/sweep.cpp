// SPDX-License-Identifier: MIT
#include "bake_minimal/sweep.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

namespace relit::bake {
namespace {

using container::Chroma;

constexpr std::size_t kMostVariants = 1000;

struct Knob {
  std::string_view name;
  std::string_view label;  ///< before the value in a variant's name
  bool (*set)(CodingOptions& options, const std::string& value);
};

template <class T>
bool parse(const std::string& text, T& out) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  return error == std::errc() && end == text.data() + text.size();
}

template <class T>
bool choose(const std::string& text, std::initializer_list<std::pair<const char*, T>> values,
            T& out) {
  for (const auto& [name, value] : values) {
    if (text != name) continue;
    out = value;
    return true;
  }
  return false;
}

template <class T>
bool parse_optional(const std::string& text, std::optional<T>& out) {
  return parse(text, out.emplace());
}

const std::array<Knob, 12> kKnobs{{
    {"codec", "", [](CodingOptions& o, const std::string& v) { return !(o.codec = v).empty(); }},
    {"crf", "crf", [](CodingOptions& o, const std::string& v) { return parse_optional(v, o.crf); }},
    {"planes", "",
     [](CodingOptions& o, const std::string& v) {
       return choose<Planes>(v, {{"colour", Planes::kColour}, {"principal", Planes::kPrincipal}},
                             o.planes);
     }},
    {"principal-count", "count",
     [](CodingOptions& o, const std::string& v) { return parse(v, o.principal_count); }},
    {"prediction", "prediction-",
     [](CodingOptions& o, const std::string& v) {
       return choose<bool>(v, {{"on", true}, {"off", false}}, o.predict);
     }},
    {"bit-depth", "bits",
     [](CodingOptions& o, const std::string& v) { return parse_optional(v, o.bit_depth); }},
    {"chroma", "",
     [](CodingOptions& o, const std::string& v) {
       return choose<Chroma>(
           v, {{"420", Chroma::k420}, {"444", Chroma::k444}, {"luma", Chroma::kLuma}},
           o.chroma.emplace());
     }},
    {"exponent-block", "block",
     [](CodingOptions& o, const std::string& v) { return parse(v, o.exponent_block); }},
    {"exponent-hold", "hold",
     [](CodingOptions& o, const std::string& v) { return parse(v, o.exponent_hold); }},
    {"frame-step", "step",
     [](CodingOptions& o, const std::string& v) { return parse(v, o.frame_step); }},
    {"layout", "",
     [](CodingOptions& o, const std::string& v) {
       return choose<Layout>(v, {{"layered", Layout::kLayered}, {"grid", Layout::kGrid}}, o.layout);
     }},
    {"encoder-preset", "",
     [](CodingOptions& o, const std::string& v) { return !(o.preset = v).empty(); }},
}};

std::vector<std::string> pieces(std::string_view text, std::string_view separators) {
  std::vector<std::string> out;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of(separators), text.size());
    if (end > 0) out.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out;
}

Unexpected invalid(const std::string& what) {
  return fail(ErrorCode::kInvalid, "--sweep: " + what);
}

std::string known_knobs() {
  std::string names;
  for (const Knob& knob : kKnobs) names += (names.empty() ? "" : ", ") + std::string(knob.name);
  return names;
}

/// Every variant so far with every value of one more knob.
Result<std::vector<CodingVariant>> vary(const std::vector<CodingVariant>& variants,
                                        const std::string& setting) {
  const std::size_t equals = std::min(setting.find('='), setting.size());
  const std::string name = setting.substr(0, equals);
  const auto knob =
      std::find_if(kKnobs.begin(), kKnobs.end(), [&](const Knob& k) { return k.name == name; });
  if (knob == kKnobs.end())
    return invalid("there is no knob \"" + name + "\"; there are " + known_knobs());
  const std::vector<std::string> values =
      pieces(std::string_view(setting).substr(std::min(equals + 1, setting.size())), ",");
  if (values.empty()) return invalid(name + " has no values: the form is " + name + "=A,B");
  if (variants.size() * values.size() > kMostVariants)
    return invalid("more than " + std::to_string(kMostVariants) + " combinations");
  std::vector<CodingVariant> more;
  for (const CodingVariant& variant : variants) {
    for (const std::string& value : values) {
      CodingVariant next = variant;
      if (!knob->set(next.coding, value)) return invalid(name + " cannot be \"" + value + "\"");
      next.name += (next.name.empty() ? "" : "-") + std::string(knob->label) + value;
      more.push_back(std::move(next));
    }
  }
  return more;
}

}  // namespace

Result<std::vector<CodingVariant>> expand_sweep(std::string_view text, const CodingOptions& base) {
  std::vector<CodingVariant> variants{{"", base}};
  const std::vector<std::string> settings = pieces(text, " ;");
  if (settings.empty())
    return invalid("nothing to vary: the form is \"codec=h264,hevc crf=12,18\"");
  for (const std::string& setting : settings) {
    RELIT_ASSIGN(variants, vary(variants, setting));
  }
  for (const CodingVariant& variant : variants) {
    if (const auto resolved = resolve(variant.coding); !resolved)
      return invalid(variant.name + ": " + resolved.error().message);
  }
  return variants;
}

}  // namespace relit::bake
