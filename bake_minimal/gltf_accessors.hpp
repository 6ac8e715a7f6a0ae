// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bake_minimal/gltf_document.hpp"
#include "container/base/result.hpp"

namespace relit::bake::gltf {

/// What an accessor must look like to be used for something.
struct AccessorUse {
  std::string where;                 ///< who reads it, for messages
  int components = 1;                ///< 1 SCALAR, 2 VEC2, 3 VEC3, 4 VEC4, 16 MAT4
  int other_components = 0;          ///< also taken, e.g. VEC3 colours; 0: nothing else
  bool integers_are_values = false;  ///< unnormalised integers may stand for themselves
};

/// Numbers of an accessor, one element after the other.
struct Numbers {
  int components = 0;
  std::size_t count = 0;      ///< of elements
  std::vector<float> values;  ///< components × count; may hold NaN and infinities
};

/// Reads floats or normalised integers (glTF 2.0, section 3.6.2.2), strides and sparse substitution
/// included. Errors: kCorrupt (no such accessor, wrong type, leaves its bufferView), kLimit.
[[nodiscard]] Result<Numbers> read_numbers(const Document& document, int accessor,
                                           const AccessorUse& use);

/// Integers of a SCALAR or VEC4 accessor of unsigned components (indices, joints). Errors: as
/// above.
struct Integers {
  int components = 0;
  std::size_t count = 0;
  std::vector<std::uint32_t> values;
};
[[nodiscard]] Result<Integers> read_integers(const Document& document, int accessor,
                                             const AccessorUse& use);

}  // namespace relit::bake::gltf
