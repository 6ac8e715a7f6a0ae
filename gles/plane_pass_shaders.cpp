// SPDX-License-Identifier: MIT
#include <algorithm>
#include <bit>

#include "gles/plane_pass.hpp"
#include "gles/shaders.hpp"

namespace relit::gles {
namespace {

constexpr const char* kBatchNames[] = {"BATCH_DATA",     "BATCH_COUNT",    "BATCH_SUM",
                                       "BATCH_GROUPS",   "BATCH_STRIDE",   "BATCH_PLANES",
                                       "BATCH_MANTISSA", "BATCH_SHEET_0",  "BATCH_SHEET_1",
                                       "BATCH_SHEET_2",  "BATCH_EXPONENTS"};

std::string define(const std::string& name, const std::string& value) {
  return "#define " + name + " " + value + "\n";
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
  return text;
}

std::string PlanePass::batch_text(std::size_t index) const {
  const Batch& batch = batches_[index];
  std::string text = define("BATCH_PLANES", std::to_string(batch.planes_per_group));
  text += define("BATCH_MANTISSA", batch.wide ? "mantissa10" : "mantissa8");
  for (int i = 0; i < batch.planes_per_group; ++i)
    text += define("BATCH_SHEET_" + std::to_string(i),
                   sheet_name(batch.sheets[static_cast<std::size_t>(i)]));
  if (batch.exponent_sheet >= 0)
    text += define("BATCH_EXPONENTS", sheet_name(batch.exponent_sheet));
  return text;
}

std::string PlanePass::text(PlaneTaps taps) const {
  std::string text = samplers();
  if (taps == PlaneTaps::kFour) text += define("FOUR_TAPS", "1");
  text += shaders::composite_head;
  text += shaders::composite_taps;
  std::string sums;
  for (std::size_t b = 0; b < batches_.size(); ++b) {
    const std::string index = std::to_string(b);
    text += batch_text(b);
    text += define("BATCH_DATA", "u_batch" + index);
    text += define("BATCH_COUNT", "u_count" + index);
    text += define("BATCH_SUM", "sum" + index);
    text += define("BATCH_GROUPS", std::to_string(batches_[b].groups.size()));
    text += define("BATCH_STRIDE", std::to_string(batches_[b].stride()));
    text += shaders::composite_loop;
    for (const char* name : kBatchNames) text += std::string("#undef ") + name + "\n";
    sums += " + sum" + index + "()";
  }
  return text + "vec3 plane_sum() { return u_constant" + sums + "; }\n";
}

std::string PlanePass::unrolled_uniforms() const {
  std::string text(shaders::composite_head);
  if (batches_.empty()) return text;
  const Batch& batch = batches_.front();
  const std::size_t weights =
      batch.groups.size() * static_cast<std::size_t>(batch.planes_per_group);
  return text + "uniform vec4 u_weight[" + std::to_string(weights) + "];\n" + batch_text(0);
}

std::string PlanePass::unrolled_statements() const {
  std::string text;
  std::size_t varying = 0;
  for (int g = 0; g < group_count(); ++g) {
    text += define("GROUP", std::to_string(g));
    std::string undefine = "#undef GROUP\n";
    for (int i = 0; i < lookups_per_group(); ++i) {
      const std::string name =
          "GROUP_UV_" + (i < planes_per_group() ? std::to_string(i) : std::string("E"));
      text += define(name, "v" + std::to_string(varying++));
      undefine += "#undef " + name + "\n";
    }
    text += shaders::composite_unrolled;
    text += undefine;
  }
  return text;
}

}  // namespace relit::gles
