// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tests/conformance/draft.hpp"

namespace relit::conformance {

/// What a reader must make of a file.
enum class Outcome {
  kWhole,    ///< it reads all records
  kLossy,    ///< it reads what is left, and says that something was lost
  kRefused,  ///< it gives an error
};

struct Vector {
  std::string name;
  std::string description;
  Outcome outcome = Outcome::kWhole;
  /// Ids of container/VALIDATION.md that a validator reports, each once, in any order.
  std::vector<std::string> findings;
  std::function<Bytes()> make;
  /// Breaks a rule of FORMAT.md, though a reader may not notice. Warnings are not meant.
  bool valid = true;
  /// Whether meshes, poses and pictures can be opened, where the records can be read.
  bool decodes = true;
};

using Vectors = std::vector<Vector>;

void add_codings(Vectors& vectors);     ///< codecs, layouts, exponents, colour, order
void add_structures(Vectors& vectors);  ///< what may be left out, repeated and added; extremes
void add_extremes(Vectors& vectors);    ///< rigs, several clips, values at their limits
void add_damage(Vectors& vectors);      ///< checksums, framing, truncation, versions, unknown types
void add_payloads(Vectors& vectors);    ///< fields of single records out of their range
void add_layer_payloads(Vectors& vectors);
void add_segment_payloads(Vectors& vectors);  ///< and those of chunks, index and end
void add_references(Vectors& vectors);        ///< records that contradict each other
void add_contents(Vectors& vectors);          ///< coded bytes that do not decode

/// All of them, with unique names.
Vectors all_vectors();

}  // namespace relit::conformance
