// SPDX-License-Identifier: MIT
#include "player/file_survey.hpp"

namespace relit::player {

using namespace container;

namespace {

void note(FileSurvey& survey, Record record) {
  if (auto* segment = std::get_if<SegmentRecord>(&record.body)) {
    for (const auto& chunk : segment->chunks)
      survey.track_bytes[chunk.track_id] += chunk.chunk_bytes;
    survey.segments.push_back({record.offset_bytes, std::move(*segment), {}});
  } else if (auto* chunk = std::get_if<ChunkRecord>(&record.body)) {
    survey.segments.back().chunks.push_back(
        {chunk->track_id, std::move(chunk->packets), chunk->data.size(), crc32(chunk->data)});
  } else if (auto* index = std::get_if<IndexRecord>(&record.body)) {
    survey.index = std::move(*index);
  } else if (const auto* end = std::get_if<EndRecord>(&record.body)) {
    survey.end = *end;
  }
}

}  // namespace

Result<FileSurvey> survey_file(std::unique_ptr<ByteSource> source, bool packets) {
  FileSurvey survey;
  ReaderOptions options;
  options.sparing = !packets;
  options.on_passed_over = [&survey](const RecordHeader& header, std::uint64_t offset_bytes) {
    survey.passed_over.push_back({offset_bytes, header});
  };
  RELIT_ASSIGN(Reader reader, Reader::open(std::move(source), options));
  RELIT_ASSIGN(survey.contents, load_static(reader));
  if (!packets) reader.set_wanted_tracks(std::vector<std::uint32_t>{});
  for (;;) {
    auto record = reader.next();
    if (!record) {
      survey.damage = record.error().message;
      if (reader.can_continue()) continue;
      const auto again = reader.resync();
      if (!again || !*again) break;
      continue;
    }
    if (!*record) break;
    note(survey, std::move(**record));
  }
  survey.bytes = reader.offset_bytes();
  survey.loss = reader.loss();
  return survey;
}

}  // namespace relit::player
