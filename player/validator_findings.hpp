// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "container/framing.hpp"
#include "player/validator.hpp"

/// The one table of what a validator can find, and the list of what it found.
namespace relit::player {

inline constexpr FindingKind kFindingKinds[] = {
    {"FRAMING_SIGNATURE", Severity::kError, "The file does not begin with the signature."},
    {"FRAMING_HEADER_CRC", Severity::kError, "A record's header does not match its checksum."},
    {"FRAMING_TYPE", Severity::kError,
     "A record's type is not four letters of which the third is upper case."},
    {"FRAMING_LENGTH", Severity::kError,
     "A record, or the static part in all, is longer than the limits allow."},
    {"FRAMING_PAYLOAD_CRC", Severity::kError, "A record's payload does not match its checksum."},
    {"FRAMING_PADDING", Severity::kError, "The padding behind a payload is not zero."},
    {"FRAMING_TRUNCATED", Severity::kError, "The file ends inside a record or a segment."},
    {"FRAMING_CRITICAL_TYPE", Severity::kError,
     "A critical record has a type that this version does not know."},
    {"FRAMING_CRITICAL_FLAG", Severity::kError,
     "A critical record has a critical flag that is not defined for it."},
    {"FRAMING_UNDEFINED_FLAG", Severity::kWarning,
     "A record has a flag that is not defined and that readers ignore or pass over."},
    {"FRAMING_UNKNOWN_RECORD", Severity::kInfo,
     "A public ancillary record has a type that this version does not know."},
    {"FRAMING_PRIVATE_RECORD", Severity::kInfo, "A record of a private type is passed over."},

    {"ORDER_HEAD", Severity::kError, "The first record is not HEAD."},
    {"ORDER_RECORD", Severity::kError, "A record stands out of its place, or a second time."},
    {"ORDER_NO_CLIP", Severity::kError, "The file has no CLIP."},
    {"ORDER_BEHIND_END", Severity::kError, "Something follows FEND."},

    {"HEAD_VERSION", Severity::kError,
     "The format's version is one that this validator cannot read."},
    {"HEAD_NEWER_MINOR", Severity::kInfo,
     "The format's minor version is newer than this validator."},
    {"HEAD_CORRUPT", Severity::kError, "A field of HEAD breaks a rule."},
    {"HEAD_LIMIT", Severity::kError, "A field of HEAD exceeds a limit."},

    {"CLIP_CORRUPT", Severity::kError, "A field of CLIP breaks a rule."},
    {"CLIP_LIMIT", Severity::kError, "A field of CLIP exceeds a limit."},
    {"CLIP_INCOMPLETE", Severity::kWarning,
     "The segments of a complete file do not reach the end of a clip that has tracks."},

    {"IMAG_CORRUPT", Severity::kError, "A field of IMAG breaks a rule."},
    {"IMAG_LIMIT", Severity::kError, "A field of IMAG exceeds a limit."},
    {"IMAG_UNSUPPORTED", Severity::kError,
     "An image has a media type that is not of this version."},

    {"MATL_CORRUPT", Severity::kError, "A field of MATL breaks a rule."},
    {"MATL_LIMIT", Severity::kError, "A field of MATL exceeds a limit."},
    {"MATL_UNSUPPORTED", Severity::kError, "An enumerator of MATL is unknown to this version."},

    {"MESH_CORRUPT", Severity::kError, "A field of MESH breaks a rule."},
    {"MESH_LIMIT", Severity::kError, "A field of MESH exceeds a limit."},
    {"MESH_UNSUPPORTED", Severity::kError, "An enumerator of MESH is unknown to this version."},

    {"SKEL_CORRUPT", Severity::kError, "A field of SKEL breaks a rule."},
    {"SKEL_LIMIT", Severity::kError, "A field of SKEL exceeds a limit."},

    {"POSE_CORRUPT", Severity::kError, "A field of POSE breaks a rule."},
    {"POSE_LIMIT", Severity::kError, "A field of POSE exceeds a limit."},
    {"POSE_UNSUPPORTED", Severity::kError, "An enumerator of POSE is unknown to this version."},

    {"MODL_CORRUPT", Severity::kError, "A field of MODL breaks a rule."},
    {"MODL_LIMIT", Severity::kError, "A field of MODL exceeds a limit."},
    {"MODL_UNSUPPORTED", Severity::kError, "A model is of a kind that is not of this version."},

    {"LAYR_CORRUPT", Severity::kError, "A field of LAYR breaks a rule."},
    {"LAYR_LIMIT", Severity::kError, "A field of LAYR exceeds a limit."},
    {"LAYR_UNSUPPORTED", Severity::kError, "An enumerator of LAYR is unknown to this version."},

    {"REF_INVALID", Severity::kError,
     "An id is used twice, a reference leads nowhere, or records contradict each other."},
    {"REF_LIMIT", Severity::kError,
     "There are too many records or planes, samples of video, or vertices, indices and morph "
     "offsets of all meshes."},

    {"SEGM_CORRUPT", Severity::kError, "A field of SEGM breaks a rule."},
    {"SEGM_LIMIT", Severity::kError, "A field of SEGM exceeds a limit."},
    {"SEGM_INDEX", Severity::kError, "A segment's number is not greater than all before it."},
    {"SEGM_INDEX_GAP", Severity::kWarning, "Numbers of segments are left out."},
    {"SEGM_CLIP", Severity::kError, "A segment is of a clip that does not exist."},
    {"SEGM_FRAMES", Severity::kError, "A segment has frames beyond the end of its clip."},
    {"SEGM_OVERLAP", Severity::kError,
     "A segment begins before the end of the segment before it of the same clip."},
    {"SEGM_GAP", Severity::kWarning, "Frames between two segments of a clip are left out."},
    {"SEGM_TICKS", Severity::kError,
     "A segment's first_tick is not the sum of the ticks of the frames before it."},
    {"SEGM_DURATION", Severity::kError,
     "The durations of a clip's frames do not add up to its duration_ticks."},
    {"SEGM_MISSING_TRACK", Severity::kWarning, "A segment has no chunk for a track of its clip."},
    {"SEGM_UNKNOWN_TRACK", Severity::kWarning,
     "A segment has a chunk for a track that its clip does not have."},
    {"SEGM_CHUNK_ORDER", Severity::kWarning,
     "The chunks of a segment do not stand in the order in which their tracks are declared."},

    {"CHNK_CORRUPT", Severity::kError, "A field of CHNK breaks a rule."},
    {"CHNK_LIMIT", Severity::kError, "A field of CHNK exceeds a limit."},
    {"CHNK_STRAY", Severity::kError, "A chunk follows no segment that announces it."},
    {"CHNK_ANNOUNCED", Severity::kError,
     "The record behind a segment is not the chunk that the segment announces there."},
    {"CHNK_KEY", Severity::kError, "The first packet of a track in a segment is not a key."},
    {"CHNK_PTS", Severity::kError,
     "A packet's frame is not of the segment, or the first packet's not the first frame."},
    {"CHNK_POSE_PACKETS", Severity::kError,
     "A pose track has another number of packets in a segment than one."},

    {"COPY_WITHOUT_ORIGINAL", Severity::kError,
     "A record is flagged as a copy, but none of its type stands before it."},
    {"COPY_DIFFERENT", Severity::kError, "A copy is not identical to any record before it."},
    {"COPY_ORDER", Severity::kWarning,
     "The copies behind the last segment are not those of all static records in their order."},
    {"COPY_MISSING", Severity::kWarning, "A complete file has no copies of its static records."},

    {"INDX_CORRUPT", Severity::kError, "A field of INDX breaks a rule."},
    {"INDX_LIMIT", Severity::kError, "A field of INDX exceeds a limit."},
    {"INDX_ENTRY", Severity::kError, "An entry of the index is not what the file holds there."},
    {"INDX_SEGMENT", Severity::kError, "A segment is not in the index."},
    {"INDX_MISSING", Severity::kWarning, "A complete file with segments has no index."},

    {"FEND_CORRUPT", Severity::kError, "A field of FEND breaks a rule."},
    {"FEND_INDEX_OFFSET", Severity::kError, "FEND says that the index is where it is not."},
    {"FEND_COPIES_OFFSET", Severity::kError, "FEND says that the copies are where they are not."},
    {"FEND_FILE_BYTES", Severity::kError, "FEND says another length of the file than it has."},
    {"FEND_MISSING", Severity::kWarning, "The file ends without FEND."},

    {"DECODE_IMAGE", Severity::kError, "An image does not decode."},
    {"DECODE_MESH", Severity::kError,
     "A stream of a mesh does not decode, or its values break a rule."},
    {"DECODE_POSE_TRACK", Severity::kError,
     "The values of a pose track or of the skeleton lead beyond the bounds."},
    {"DECODE_POSE_PACKET", Severity::kError, "A pose packet does not decode."},
    {"DECODE_POSE_MATRIX", Severity::kError,
     "The pose of a frame has a palette matrix that is not finite or beyond the bounds."},

    {"VIDEO_OPEN", Severity::kError, "A track's codec_private is refused by the decoder."},
    {"VIDEO_CODEC", Severity::kWarning,
     "A track's codec is not one that can be decoded here, so its packets are not checked."},
    {"VIDEO_PICTURE", Severity::kError,
     "A packet does not decode to a picture of the size and format that its layer promises."},
    {"VIDEO_PICTURES", Severity::kError,
     "A track that says that its decoder holds one picture is not coded intra and in order."},
    {"VIDEO_EXPONENT", Severity::kWarning,
     "An exponent lies between 0 and the smallest that writers emit."},
    {"VIDEO_TRANSFER", Severity::kInfo,
     "The mean transfer T_0 of a picture lies outside what passive surfaces can have. Not looked "
     "at "
     "where charts lie over one another many times."},
};

/// An entry of the table, looked up where the program is compiled.
class FindingId {
 public:
  consteval FindingId(const char* id) : kind_(find(id)) {
    if (kind_ == nullptr) throw std::logic_error("no such finding");
  }
  /// The entry PREFIX_SUFFIX, or PREFIX_CORRUPT, which must exist.
  FindingId(std::string_view prefix, std::string_view suffix);

  [[nodiscard]] constexpr const FindingKind* kind() const { return kind_; }

 private:
  static constexpr const FindingKind* find(std::string_view id) {
    for (const FindingKind& kind : kFindingKinds) {
      if (kind.id == id) return &kind;
    }
    return nullptr;
  }
  const FindingKind* kind_;
};

/// Where a finding is.
struct FindingPlace {
  std::uint64_t offset_bytes = 0;
  container::RecordType type{};  ///< 0: no record
};

/// Collects findings, so many of each kind.
class FindingLog {
 public:
  explicit FindingLog(std::size_t per_kind) : per_kind_(per_kind) {}
  void add(FindingId id, const FindingPlace& place, std::string message);
  /// The finding TYPE_CORRUPT, TYPE_LIMIT or TYPE_UNSUPPORTED that an error of a record's parser
  /// means.
  void add_parse_error(const FindingPlace& place, const Error& error);
  [[nodiscard]] ValidationReport take() { return std::move(report_); }

 private:
  std::size_t per_kind_;
  std::vector<std::size_t> counts_ = std::vector<std::size_t>(std::size(kFindingKinds));
  ValidationReport report_;
};

}  // namespace relit::player
