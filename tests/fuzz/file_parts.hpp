// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "container/framing.hpp"
#include "tests/fuzz/fuzz.hpp"

/// A .relit file taken apart and put together again, so that what a mutation does to one record
/// does not stop the reader at the framing of all others.
namespace relit::fuzz {

struct Part {
  container::RecordType type{};
  std::uint32_t flags = 0;
  Bytes payload;
};

/// The records that can be found, whatever their checksums say; what lies between them is dropped.
std::vector<Part> split(Input file);

/// A file of these records with right checksums. Where segments, index and end record can be read,
/// the lengths and offsets in them are made right too.
Bytes join(std::vector<Part> parts);

}  // namespace relit::fuzz
