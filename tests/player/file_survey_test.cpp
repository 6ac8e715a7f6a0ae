// SPDX-License-Identifier: MIT
#include "player/file_survey.hpp"

#include "tests/player/files.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::player;
using namespace relit::player::test;

namespace {

Result<FileSurvey> survey(std::vector<std::uint8_t> bytes, bool packets = true) {
  return survey_file(std::make_unique<container::MemorySource>(std::move(bytes)), packets);
}

}  // namespace

TEST_CASE("a survey's parts agree with each other") {
  const auto found = survey(read_bytes(shipped_clip()));
  REQUIRE(found);
  CHECK(found->damage.empty());
  REQUIRE(found->end);
  CHECK(found->end->file_bytes == found->bytes);
  REQUIRE(found->index);
  REQUIRE(found->index->segments.size() == found->segments.size());
  std::uint64_t frames = 0;
  for (std::size_t i = 0; i < found->segments.size(); ++i) {
    const SurveyedSegment& segment = found->segments[i];
    CHECK(found->index->segments[i].offset == segment.offset_bytes);
    CHECK(segment.chunks.size() == segment.record.chunks.size());
    frames += segment.record.frame_count;
  }
  CHECK(frames == found->contents.clips.at(0).frame_count);
  REQUIRE(!found->passed_over.empty());
  CHECK(found->passed_over.front().offset_bytes == found->end->copies_offset);
}

TEST_CASE("without packets a survey says the same of everything else") {
  const auto with = survey(read_bytes(shipped_clip()));
  const auto without = survey(read_bytes(shipped_clip()), false);
  REQUIRE(with);
  REQUIRE(without);
  CHECK(without->segments.at(0).chunks.empty());
  auto json = survey_json(*with);
  for (auto& segment : json.at("segments")) {
    for (auto& chunk : segment.at("chunks")) chunk["packets"] = chunk["data"] = nullptr;
  }
  CHECK(json == survey_json(*without));
}

TEST_CASE("a survey says what damage took") {
  std::vector<std::uint8_t> bytes = read_bytes(shipped_clip());
  const auto intact = survey(bytes);
  REQUIRE(intact);
  const SurveyedSegment& hit = intact->segments.at(1);
  // The last byte of the segment's last chunk, or of its padding.
  std::uint64_t end = intact->segments.at(2).offset_bytes;
  bytes.at(end - 9) ^= 0x55;
  const auto found = survey(bytes);
  REQUIRE(found);
  CHECK(!found->damage.empty());
  CHECK(found->loss.damaged_records == 1);
  CHECK(found->segments.at(1).chunks.size() == hit.chunks.size() - 1);
  const auto json = survey_json(*found);
  CHECK(json.at("segments").at(1).at("chunks").back().at("packets").is_null());
  CHECK(json.at("lost").at("records") == 1);
}
