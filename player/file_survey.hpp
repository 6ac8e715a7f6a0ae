// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "container/reader.hpp"

/// What a file holds, without decoding any of it.
namespace relit::player {

/// A chunk that was read: its packet table, and its data as a checksum.
struct SurveyedChunk {
  std::uint32_t track_id = 0;
  std::vector<container::Packet> packets;
  std::uint64_t data_bytes = 0;
  std::uint32_t data_crc = 0;
};

struct SurveyedSegment {
  std::uint64_t offset_bytes = 0;
  container::SegmentRecord record;
  std::vector<SurveyedChunk> chunks;  ///< the intact ones; empty where they were not asked for
};

/// A copy, or a record of a type that this version does not know.
struct PassedOver {
  std::uint64_t offset_bytes = 0;
  container::RecordHeader header;
};

struct FileSurvey {
  container::FileContents contents;
  std::vector<SurveyedSegment> segments;
  std::vector<PassedOver> passed_over;  ///< in the order of the file
  std::optional<container::IndexRecord> index;
  std::optional<container::EndRecord> end;             ///< none: cut off, or still being written
  std::map<std::uint32_t, std::uint64_t> track_bytes;  ///< chunk records, as segments announce them
  std::uint64_t bytes = 0;
  container::ReaderLoss loss;
  std::string damage;  ///< the last error that reading went on after; empty: none
};

/// Reads a file from front to back, going on behind damage as the player does. With `packets` the
/// chunks are read and checked, else they are passed over. Errors: as Reader::open() and
/// load_static().
[[nodiscard]] Result<FileSurvey> survey_file(std::unique_ptr<container::ByteSource> source,
                                             bool packets);

/// "luma", "4:2:0" or "4:4:4".
[[nodiscard]] const char* chroma_name(container::Chroma chroma);
/// "joints" or "vertices".
[[nodiscard]] const char* pose_kind_name(container::PoseKind kind);

/// The whole parsed structure under the schema of container/INFO.md.
[[nodiscard]] nlohmann::ordered_json survey_json(const FileSurvey& survey);

}  // namespace relit::player
