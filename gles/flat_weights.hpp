// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

namespace relit::gles {

/// Numbers of uniforms that a fragment shader takes as flat inputs, which its vertex shader copies:
/// four to a vector, as many as there is room for. For renderers that look a uniform up again for
/// every few pixels (llvmpipe), and only read what comes from the vertices once. ES 3.
class FlatWeights {
 public:
  explicit FlatWeights(int vectors) : room_(4 * static_cast<std::size_t>(vectors)) {}

  /// What the fragment shader calls a number, such as "u_weight0[3].r": an input, or where there is
  /// no room left the uniform itself.
  std::string name(const std::string& uniform);

  /// For the vertex shader, behind the uniforms' declarations: FLAT_WEIGHTS is defined, and
  /// copy_weights(), which it calls.
  [[nodiscard]] std::string outputs() const;
  /// For the fragment shader's head.
  [[nodiscard]] std::string inputs() const { return declaration("in"); }

 private:
  [[nodiscard]] std::string declaration(const char* direction) const;

  std::size_t room_;
  std::vector<std::string> uniforms_;
};

}  // namespace relit::gles
