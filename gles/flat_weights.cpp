// SPDX-License-Identifier: MIT
#include "gles/flat_weights.hpp"

namespace relit::gles {
namespace {

std::string input_name(std::size_t number) {
  return "v_weights[" + std::to_string(number / 4) + "]." + "xyzw"[number % 4];
}

}  // namespace

std::string FlatWeights::name(const std::string& uniform) {
  if (uniforms_.size() == room_) return uniform;
  uniforms_.push_back(uniform);
  return input_name(uniforms_.size() - 1);
}

std::string FlatWeights::outputs() const {
  if (uniforms_.empty()) return {};
  std::string text = "#define FLAT_WEIGHTS 1\n" + declaration("out") + "void copy_weights() {\n";
  for (std::size_t i = 0; i < uniforms_.size(); ++i)
    text += "  " + input_name(i) + " = " + uniforms_[i] + ";\n";
  return text + "}\n";
}

std::string FlatWeights::declaration(const char* direction) const {
  if (uniforms_.empty()) return {};
  return std::string("flat ") + direction + " vec4 v_weights[" +
         std::to_string((uniforms_.size() + 3) / 4) + "];\n";
}

}  // namespace relit::gles
