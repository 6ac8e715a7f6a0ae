// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "container/framing.hpp"
#include "container/records.hpp"

/// Files put together by hand: unlike container::Writer this takes whatever it is given, valid or
/// not, so that the same code makes good vectors and bad ones.
namespace relit::conformance {

using Bytes = std::vector<std::uint8_t>;

/// One record before it is framed.
struct Piece {
  container::RecordType type{};
  Bytes payload;
  std::uint32_t flags = 0;
  /// INDX and FEND whose payload assemble() fills in, from where the other pieces came to lie.
  bool automatic = false;
};

struct DraftSegment {
  container::SegmentRecord record;  ///< `chunks` are filled in from those below
  std::vector<container::ChunkRecord> chunks;
};

/// The contents of a file as structures.
struct Draft {
  container::HeaderRecord header{container::kVersionMajor, container::kVersionMinor,
                                 "relit-vectors"};
  std::vector<container::ClipRecord> clips;
  std::vector<container::ImageRecord> images;
  std::vector<container::MaterialRecord> materials;
  std::vector<container::MeshRecord> meshes;
  std::optional<container::SkeletonRecord> skeleton;
  std::vector<container::PoseTrackRecord> poses;
  std::vector<container::ModelRecord> models;
  std::vector<container::LayerRecord> layers;
  std::vector<DraftSegment> segments;
  bool copies = true;
  bool index = true;
  bool end = true;
};

/// The records of a draft in the order of FORMAT.md, section 1.
std::vector<Piece> pieces_of(const Draft& draft);

/// Signature and framed records. `automatic` pieces are computed.
Bytes assemble(const std::vector<Piece>& pieces);

inline Bytes assemble(const Draft& draft) { return assemble(pieces_of(draft)); }

/// The number of the n-th piece of a type. Throws where there is none.
std::size_t find_piece(const std::vector<Piece>& pieces, container::RecordType type, int n = 0);

/// Where the header of the n-th record of a type lies in an assembled, intact file.
std::size_t offset_of(const Bytes& file, container::RecordType type, int n = 0);

/// Computes the header checksum of the record at `offset` anew.
void seal_header(Bytes& file, std::size_t offset);

void put_u16(Bytes& bytes, std::size_t at, std::uint16_t value);
void put_u32(Bytes& bytes, std::size_t at, std::uint32_t value);
void put_u64(Bytes& bytes, std::size_t at, std::uint64_t value);

}  // namespace relit::conformance
