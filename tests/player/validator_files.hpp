// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "container/framing.hpp"
#include "container/record_codec.hpp"
#include "player/validator.hpp"
#include "tests/player/files.hpp"
#include "tests/test.hpp"

/// The shipped clip taken apart into records, changed, and put together again, and what the
/// validator says of it.
namespace relit::player::test {

using namespace relit::container;

using Bytes = std::vector<std::uint8_t>;

struct Piece {
  RecordType type{};
  std::uint32_t flags = 0;
  Bytes payload;
};
using Pieces = std::vector<Piece>;

inline Pieces split(const Bytes& file) {
  Pieces pieces;
  for (std::size_t at = kSignature.size(); at < file.size();) {
    const auto header = decode_header(std::span(file).subspan(at).first<kRecordHeaderBytes>());
    REQUIRE(header);
    const auto* begin = file.data() + at + kRecordHeaderBytes;
    pieces.push_back({header->type, header->flags, Bytes(begin, begin + header->payload_bytes)});
    at += record_bytes(header->payload_bytes);
  }
  return pieces;
}

inline Bytes join(const Pieces& pieces) {
  Bytes file(kSignature.begin(), kSignature.end());
  for (const Piece& piece : pieces) {
    const Bytes record = frame_record(piece.type, piece.payload, piece.flags);
    file.insert(file.end(), record.begin(), record.end());
  }
  return file;
}

inline std::size_t find(const Pieces& pieces, const char (&type)[5], std::size_t n = 0) {
  for (std::size_t i = 0; i < pieces.size(); ++i)
    if (pieces[i].type == record_type(type) && n-- == 0) return i;
  FAIL("no such record");
  return 0;
}

inline Piece& get(Pieces& pieces, const char (&type)[5], std::size_t n = 0) {
  return pieces[find(pieces, type, n)];
}

inline void drop(Pieces& pieces, std::size_t at) {
  pieces.erase(pieces.begin() + static_cast<std::ptrdiff_t>(at));
}

inline void insert(Pieces& pieces, std::size_t at, Piece piece) {
  pieces.insert(pieces.begin() + static_cast<std::ptrdiff_t>(at), std::move(piece));
}

// Makes the lengths that segments announce, the index's offsets and the end record fit.
inline void relink(Pieces& pieces) {
  std::uint64_t at = kSignature.size(), index = 0, copies = 0;
  std::map<std::uint32_t, std::uint64_t> segments;
  for (std::size_t i = 0; i < pieces.size(); at += record_bytes(pieces[i++].payload.size())) {
    Piece& piece = pieces[i];
    if (piece.type == types::kSegment) {
      copies = 0;
      auto segment = parse_segment(piece.payload);
      if (!segment) continue;
      for (std::size_t k = 0; k < segment->chunks.size(); ++k)
        if (i + 1 + k < pieces.size() && pieces[i + 1 + k].type == types::kChunk)
          segment->chunks[k].chunk_bytes = record_bytes(pieces[i + 1 + k].payload.size());
      piece.payload = serialize(*segment);
      segments[segment->index] = at;
    } else if (piece.type == types::kIndex && piece.flags == 0) {
      index = at;
      auto record = parse_index(piece.payload);
      if (!record) continue;
      for (auto& entry : record->segments) entry.offset = segments[entry.segment_index];
      piece.payload = serialize(*record);
    } else if (piece.type == types::kEnd) {
      piece.payload = serialize(EndRecord{index, at + record_bytes(kEndPayloadBytes), copies});
    } else if ((piece.flags & flags::kCopy) != 0 && copies == 0) {
      copies = at;
    }
  }
}

template <class R>
void edit(Pieces& pieces, const char (&type)[5], Result<R> (*parse)(std::span<const std::uint8_t>),
          const std::function<void(R&)>& change, std::size_t n = 0) {
  const Bytes before = get(pieces, type, n).payload;
  auto record = parse(before);
  REQUIRE(record);
  change(*record);
  for (Piece& piece : pieces)  // and the copy
    if (piece.type == record_type(type) && piece.payload == before)
      piece.payload = serialize(*record);
}

// The shipped clip, with decoders' pictures stated as H.264 with one reference needs them.
inline const Pieces& base() {
  static const Pieces pieces = [] {
    Pieces p = split(read_bytes(shipped_clip()));
    for (Piece& piece : p) {
      if (piece.type != types::kLayer) continue;
      auto layer = parse_layer(piece.payload);
      REQUIRE(layer);
      layer->mantissa_pictures = std::max<std::uint8_t>(layer->mantissa_pictures, 4);
      piece.payload = serialize(*layer);
    }
    return p;
  }();
  return pieces;
}

inline ValidationReport examine(Bytes file, bool decode = false, std::size_t per_kind = 100) {
  auto report = validate(std::make_unique<MemorySource>(std::move(file)), {per_kind, decode, 1});
  REQUIRE(report);
  return *report;
}

inline std::set<std::string> ids(const ValidationReport& report) {
  std::set<std::string> found;
  for (const Finding& finding : report.findings) found.emplace(finding.kind->id);
  return found;
}

inline std::string list(const ValidationReport& report) {
  std::ostringstream out;
  for (const Finding& f : report.findings)
    out << f.offset_bytes << ' ' << f.kind->id << ' ' << f.record << ' ' << f.message << '\n';
  return out.str();
}

struct Case {
  const char* id;
  std::function<void(Pieces&)> change;
  bool decode = false;
  bool only = true;  ///< nothing else is found
};

inline void check(const Case& c, const Bytes& file) {
  const ValidationReport report = examine(file, c.decode);
  INFO(c.id << ":\n" << list(report));
  CHECK(ids(report).count(c.id) == 1);
  if (c.only) CHECK(ids(report).size() == 1);
}

inline void check_linked(const std::vector<Case>& cases) {
  for (const Case& c : cases) {
    Pieces pieces = base();
    c.change(pieces);
    relink(pieces);
    check(c, join(pieces));
  }
}

inline void poke(Piece& piece, std::size_t at, std::initializer_list<std::uint8_t> bytes) {
  std::copy(bytes.begin(), bytes.end(), piece.payload.begin() + static_cast<std::ptrdiff_t>(at));
}

}  // namespace relit::player::test
