// SPDX-License-Identifier: MIT
// Checksums, framing, truncation, versions, unknown types and flags.
#include "container/record_codec.hpp"
#include "tests/conformance/making.hpp"

namespace relit::conformance {

using namespace container;

namespace {

constexpr std::size_t kPayload = kRecordHeaderBytes;

const RecordType kStatics[] = {types::kClip,  types::kImage,    types::kMaterial,
                               types::kMesh,  types::kSkeleton, types::kPoseTrack,
                               types::kModel, types::kLayer};

std::string lower(RecordType type) {
  std::string name = type_name(type);
  for (char& c : name) c = static_cast<char>(c | 0x20);
  return name;
}

void add_payload_checksums(Vectors& vectors) {
  const auto hit = [](RecordType type) {
    return [type](Bytes& b) { b.at(offset_of(b, type) + kPayload + 1) ^= 1; };
  };
  for (const RecordType type : kStatics) {
    from_bytes(vectors, "payload-crc-" + lower(type),
               "a bit of " + type_name(type) + " is wrong; its copy is not",
               faulty({"FRAMING_PAYLOAD_CRC"}), hit(type));
  }
  for (const RecordType type : {types::kSegment, types::kChunk, types::kIndex, types::kEnd}) {
    from_bytes(vectors, "payload-crc-" + lower(type),
               "a bit of the first " + type_name(type) + " is wrong",
               lossy({"FRAMING_PAYLOAD_CRC"}), hit(type));
  }
  from_bytes(vectors, "payload-crc-head", "a bit of HEAD is wrong; a copy follows",
             refused({"FRAMING_PAYLOAD_CRC"}), hit(types::kHeader));
  from_bytes(vectors, "payload-crc-copy", "a bit of the copy of CLIP is wrong, which nobody needs",
             faulty({"FRAMING_PAYLOAD_CRC"}),
             [](Bytes& b) { b.at(offset_of(b, types::kClip, 1) + kPayload + 1) ^= 1; });
  add(vectors, "payload-crc-no-copy", "a bit of CLIP is wrong, and there are no copies",
      refused({"FRAMING_PAYLOAD_CRC", "COPY_MISSING"}), [] {
        Draft draft = figure();
        draft.copies = false;
        Bytes b = assemble(draft);
        b.at(offset_of(b, types::kClip) + kPayload + 1) ^= 1;
        return b;
      });
  from_bytes(vectors, "payload-crc-last-chunk", "a bit of the last chunk is wrong",
             lossy({"FRAMING_PAYLOAD_CRC"}),
             [](Bytes& b) { b.at(offset_of(b, types::kChunk, 3) + kPayload + 30) ^= 1; });
}

void add_headers(Vectors& vectors) {
  const auto hit = [](RecordType type) {
    return [type](Bytes& b) { b.at(offset_of(b, type) + 8) ^= 1; };
  };
  for (const RecordType type : {types::kMesh, types::kLayer}) {
    from_bytes(vectors, "header-crc-" + lower(type),
               "the header of " + type_name(type) + " is damaged; copies from there on serve",
               faulty({"FRAMING_HEADER_CRC"}), hit(type));
  }
  for (const RecordType type : {types::kSegment, types::kChunk, types::kIndex, types::kEnd}) {
    from_bytes(vectors, "header-crc-" + lower(type),
               "the header of the first " + type_name(type) + " is damaged",
               lossy({"FRAMING_HEADER_CRC"}), hit(type));
  }
  from_bytes(vectors, "header-crc-head", "the header of HEAD is damaged",
             refused({"FRAMING_HEADER_CRC"}), hit(types::kHeader));
  from_bytes(vectors, "padding", "a byte of padding is not zero", lossy({"FRAMING_PADDING"}),
             [](Bytes& b) {
               // Behind a chunk whose length is no multiple of 8.
               const std::size_t at = offset_of(b, types::kSegment, 1);
               b.at(at - 1) = 1;
             });
  from_bytes(vectors, "type-reserved", "a type whose third letter is lower case",
             lossy({"FRAMING_TYPE"}), [](Bytes& b) {
               const std::size_t at = offset_of(b, types::kIndex);
               b.at(at + 2) = 'd';
               seal_header(b, at);
             });
  from_bytes(vectors, "type-no-letters", "a type that is no letters", lossy({"FRAMING_TYPE"}),
             [](Bytes& b) {
               const std::size_t at = offset_of(b, types::kIndex);
               b.at(at) = '1';
               seal_header(b, at);
             });
  const std::pair<const char*, std::uint64_t> lengths[] = {
      {"length-2-63", std::uint64_t{1} << 63}, {"length-limit", (std::uint64_t{1} << 30) + 1}};
  for (const auto& entry : lengths) {
    from_bytes(vectors, entry.first,
               "a chunk that says it has " + std::to_string(entry.second) + " bytes",
               lossy({"FRAMING_LENGTH"}), [length = entry.second](Bytes& b) {
                 const std::size_t at = offset_of(b, types::kChunk);
                 put_u64(b, at + 8, length);
                 seal_header(b, at);
               });
  }
  from_bytes(vectors, "length-segment", "a segment record longer than any can be",
             lossy({"FRAMING_LENGTH"}), [](Bytes& b) {
               const std::size_t at = offset_of(b, types::kSegment, 1);
               put_u64(b, at + 8, kMostSegmentPayloadBytes + 1);
               seal_header(b, at);
             });
}

void cut(Bytes& bytes, std::size_t size) { bytes.resize(size); }

void add_truncations(Vectors& vectors) {
  add(vectors, "empty", "no byte", refused({"FRAMING_SIGNATURE"}), [] { return Bytes(); });
  from_bytes(vectors, "signature-wrong", "another signature", refused({"FRAMING_SIGNATURE"}),
             [](Bytes& b) { b[1] = 'P'; });
  from_bytes(vectors, "signature-text-mode", "CR LF became LF on the way",
             refused({"FRAMING_SIGNATURE"}), [](Bytes& b) { b.erase(b.begin() + 4); });
  from_bytes(vectors, "cut-signature", "ends inside the signature", refused({"FRAMING_SIGNATURE"}),
             [](Bytes& b) { cut(b, 5); });
  from_bytes(vectors, "cut-behind-signature", "ends behind the signature",
             refused({"ORDER_NO_CLIP", "FEND_MISSING"}), [](Bytes& b) { cut(b, 8); });
  from_bytes(vectors, "cut-head", "ends inside HEAD",
             refused({"FRAMING_TRUNCATED", "FEND_MISSING"}), [](Bytes& b) { cut(b, 40); });
  from_bytes(vectors, "cut-static-header", "ends inside the header of MESH",
             refused({"FRAMING_TRUNCATED", "FEND_MISSING"}),
             [](Bytes& b) { cut(b, offset_of(b, types::kMesh) + 11); });
  from_bytes(vectors, "cut-static-payload", "ends inside MESH",
             refused({"FRAMING_TRUNCATED", "FEND_MISSING"}),
             [](Bytes& b) { cut(b, offset_of(b, types::kMesh) + 50); });
  from_bytes(vectors, "cut-behind-head", "ends behind HEAD",
             refused({"ORDER_NO_CLIP", "FEND_MISSING"}),
             [](Bytes& b) { cut(b, offset_of(b, types::kClip)); });
  from_bytes(vectors, "cut-segment", "ends inside SEGM",
             lossy({"FRAMING_TRUNCATED", "FEND_MISSING"}),
             [](Bytes& b) { cut(b, offset_of(b, types::kSegment, 1) + 60); });
  from_bytes(vectors, "cut-chunk", "ends inside a chunk",
             lossy({"FRAMING_TRUNCATED", "FEND_MISSING"}),
             [](Bytes& b) { cut(b, offset_of(b, types::kChunk, 1) + 60); });
  from_bytes(vectors, "cut-between-chunks", "ends between two chunks of a segment",
             lossy({"FRAMING_TRUNCATED", "FEND_MISSING"}),
             [](Bytes& b) { cut(b, offset_of(b, types::kChunk, 1)); });
  from_bytes(vectors, "cut-between-segments", "ends behind a segment: half a clip",
             noted({"FEND_MISSING"}), [](Bytes& b) { cut(b, offset_of(b, types::kSegment, 1)); });
  from_bytes(vectors, "cut-before-end", "FEND is missing, as in a live stream",
             noted({"FEND_MISSING"}), [](Bytes& b) { cut(b, offset_of(b, types::kEnd)); });
  from_bytes(vectors, "cut-end", "ends inside FEND", lossy({"FRAMING_TRUNCATED", "FEND_MISSING"}),
             [](Bytes& b) { cut(b, b.size() - 8); });
  from_bytes(vectors, "behind-end", "a record behind FEND", lossy({"ORDER_BEHIND_END"}),
             [](Bytes& b) {
               const Bytes record = frame_record(record_type("nOTE"), {});
               b.insert(b.end(), record.begin(), record.end());
             });
  from_bytes(vectors, "behind-end-bytes", "eight zero bytes behind FEND",
             lossy({"ORDER_BEHIND_END"}), [](Bytes& b) { b.resize(b.size() + 8); });
}

void add_lost_framing(Vectors& vectors) {
  from_bytes(vectors, "bytes-lost", "sixteen bytes of a chunk are gone: the next segment is found",
             lossy({"FRAMING_PAYLOAD_CRC", "FRAMING_HEADER_CRC", "INDX_ENTRY", "INDX_SEGMENT",
                    "FEND_INDEX_OFFSET", "FEND_FILE_BYTES"}),
             [](Bytes& b) {
               const auto at =
                   b.begin() + static_cast<std::ptrdiff_t>(offset_of(b, types::kChunk, 1) + 40);
               b.erase(at, at + 16);
             });
  from_bytes(vectors, "bytes-added", "sixteen bytes too many in a chunk",
             lossy({"FRAMING_PAYLOAD_CRC", "FRAMING_HEADER_CRC", "INDX_SEGMENT",
                    "FEND_INDEX_OFFSET", "FEND_FILE_BYTES"}),
             [](Bytes& b) {
               const auto at =
                   b.begin() + static_cast<std::ptrdiff_t>(offset_of(b, types::kChunk, 1) + 40);
               b.insert(at, 16, 0xAA);
             });
  from_bytes(vectors, "false-marker", "a marker without a header right behind the damage",
             lossy({"FRAMING_HEADER_CRC"}), [](Bytes& b) {
               const std::size_t at = offset_of(b, types::kSegment);
               b.at(at) ^= 1;
               // Its own marker is now one: the true one is that of the next segment.
             });
}

Piece unknown(const char (&letters)[5], std::uint32_t record_flags = 0) {
  return {record_type(letters), {1, 2, 3}, record_flags};
}

/// Inserts a piece before the n-th record of a type.
std::function<void(std::vector<Piece>&)> insert(Piece piece, RecordType type, int n = 0) {
  return [piece, type, n](std::vector<Piece>& p) {
    p.insert(p.begin() + static_cast<std::ptrdiff_t>(find_piece(p, type, n)), piece);
  };
}

void add_unknown(Vectors& vectors) {
  from_pieces(vectors, "unknown-ancillary", "an unknown ancillary record is passed over",
              noted({"FRAMING_UNKNOWN_RECORD"}), insert(unknown("nOTE"), types::kMesh));
  from_pieces(vectors, "unknown-ancillary-between-segments", "likewise between two segments",
              noted({"FRAMING_UNKNOWN_RECORD"}), insert(unknown("nOTe"), types::kSegment, 1));
  from_pieces(vectors, "unknown-private", "a private ancillary record",
              noted({"FRAMING_PRIVATE_RECORD"}), insert(unknown("noTe"), types::kIndex));
  from_pieces(
      vectors, "unknown-with-marker", "an ancillary record that holds a whole segment",
      noted({"FRAMING_UNKNOWN_RECORD"}), [](std::vector<Piece>& p) {
        const std::size_t at = find_piece(p, types::kSegment);
        const Bytes inside = frame_record(types::kSegment, p[at].payload);
        p.insert(p.begin() + static_cast<std::ptrdiff_t>(at), {record_type("nOTE"), inside});
      });
  from_pieces(vectors, "unknown-critical", "an unknown critical record in the static part",
              refused({"FRAMING_CRITICAL_TYPE"}), insert(unknown("PLAN"), types::kLayer));
  from_pieces(vectors, "unknown-critical-private", "a private critical record",
              refused({"FRAMING_CRITICAL_TYPE"}), insert(unknown("MyTE"), types::kClip));
  from_pieces(vectors, "unknown-critical-later", "an unknown critical record between segments",
              lossy({"FRAMING_CRITICAL_TYPE"}), insert(unknown("MTRK"), types::kSegment, 1));
  from_pieces(vectors, "unknown-critical-inside-segment",
              "an unknown critical record between SEGM and CHNK: reading ends there",
              lossy({"FRAMING_CRITICAL_TYPE", "CHNK_ANNOUNCED"}),
              insert(unknown("MTRK"), types::kChunk, 2));
  from_pieces(vectors, "unknown-inside-segment", "an ancillary record between SEGM and CHNK",
              lossy({"CHNK_ANNOUNCED", "FRAMING_UNKNOWN_RECORD"}),
              insert(unknown("nOTE"), types::kChunk));
  from_pieces(vectors, "flag-ancillary", "an undefined ancillary flag is ignored",
              noted({"FRAMING_UNDEFINED_FLAG"}),
              [](std::vector<Piece>& p) { p[find_piece(p, types::kSkeleton)].flags = 1u << 20; });
  from_pieces(vectors, "flag-critical", "an undefined critical flag on a critical record",
              refused({"FRAMING_CRITICAL_FLAG", "COPY_WITHOUT_ORIGINAL", "COPY_ORDER"}),
              [](std::vector<Piece>& p) { p[find_piece(p, types::kModel)].flags = 1u << 3; });
  from_pieces(vectors, "flag-critical-on-ancillary",
              "an undefined critical flag on an unknown ancillary record",
              noted({"FRAMING_UNDEFINED_FLAG", "FRAMING_UNKNOWN_RECORD"}),
              insert(unknown("nOTE", 1u << 15), types::kModel));
  from_pieces(vectors, "flag-copy-on-segment", "the copy flag on SEGM, where it is not defined",
              lossy({"FRAMING_CRITICAL_FLAG"}), [](std::vector<Piece>& p) {
                p[find_piece(p, types::kSegment, 1)].flags = flags::kCopy;
              });
}

void add_versions(Vectors& vectors) {
  const auto version = [](std::uint16_t major, std::uint16_t minor) {
    return [major, minor](Draft& d) {
      d.header.version_major = major;
      d.header.version_minor = minor;
    };
  };
  from_draft(vectors, "version-newer-minor", "a later minor version is read",
             noted({"HEAD_NEWER_MINOR"}), version(kVersionMajor, kVersionMinor + 1));
  from_draft(vectors, "version-newer-major", "a later major version is refused",
             refused({"HEAD_VERSION"}), version(kVersionMajor + 1, 0));
  from_draft(vectors, "version-older-draft", "an older draft is refused", refused({"HEAD_VERSION"}),
             version(0, kVersionMinor - 1));
}

}  // namespace

void add_damage(Vectors& vectors) {
  add_payload_checksums(vectors);
  add_headers(vectors);
  add_truncations(vectors);
  add_lost_framing(vectors);
  add_unknown(vectors);
  add_versions(vectors);
}

}  // namespace relit::conformance
