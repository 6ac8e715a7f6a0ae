// SPDX-License-Identifier: MIT
#include "player/recover.hpp"

#include <algorithm>

#include "player/clip_reader.hpp"
#include "player/validator.hpp"
#include "tests/player/damage.hpp"
#include "tests/player/files.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::player;
using namespace relit::player::test;
using namespace relit::container;

namespace {

struct Recovered {
  Bytes bytes;
  RecoverReport report;
};

Result<Recovered> try_recover(const Bytes& file) {
  MemorySource source{std::span<const std::uint8_t>(file)};
  MemorySink sink;
  RELIT_ASSIGN(RecoverReport report, recover(source, sink));
  return Recovered{sink.take(), std::move(report)};
}

Recovered recovered(const Bytes& file) {
  auto result = try_recover(file);
  if (!result) FAIL(result.error().message);
  return std::move(*result);
}

Bytes shipped() { return read_bytes(shipped_clip()); }

bool hits(const std::vector<Burst>& bursts, std::uint64_t begin, std::uint64_t end) {
  return std::ranges::any_of(bursts,
                             [&](const Burst& b) { return b.first < end && begin < b.second; });
}

bool same_static(const FileContents& a, const FileContents& b) {
  return a.header == b.header && a.clips == b.clips && a.images == b.images &&
         a.materials == b.materials && a.meshes == b.meshes && a.skeleton == b.skeleton &&
         a.pose_tracks == b.pose_tracks && a.models == b.models && a.layers == b.layers;
}

/// The segment of `read` that starts with a frame.
const PlacedSegment* segment_at(const Read& read, std::uint64_t first_frame) {
  const auto at = std::ranges::find_if(
      read.segments, [&](const PlacedSegment& s) { return s.segment.first_frame == first_frame; });
  return at == read.segments.end() ? nullptr : &*at;
}

/// Equal but for the numbers, which start anew.
bool same_segment(PlacedSegment a, const PlacedSegment& b) {
  a.segment.index = b.segment.index;
  for (ChunkRecord& chunk : a.chunks) chunk.segment_index = b.segment.index;
  return a.segment == b.segment && a.chunks == b.chunks;
}

/// Every frame of every segment that has all its tracks decodes without loss.
void check_decodes(const Bytes& file, const Read& read, std::size_t tracks) {
  auto clip = ClipReader::open(std::make_unique<MemorySource>(file), "recovered", {});
  if (!clip) FAIL(clip.error().message);
  ClipFrame frame;
  for (const PlacedSegment& s : read.segments) {
    if (s.chunks.size() < tracks) continue;
    for (std::uint32_t i = 0; i < s.segment.frame_count; i += 5) {
      INFO("frame " << s.segment.first_frame + i);
      REQUIRE(clip->frame(s.segment.first_frame + i, frame));
      CHECK(frame.planes.frame() == s.segment.first_frame + i);
    }
  }
  CHECK(clip->loss().frames == 0);
}

/// No error is found, payloads decoded; warnings of gaps and missing tracks are to be expected.
void validates(const Bytes& file) {
  const auto report = validate(std::make_unique<container::MemorySource>(file), {});
  REQUIRE(report);
  for (const Finding& finding : report->findings) {
    if (finding.kind->severity == Severity::kError) UNSCOPED_INFO(finding.message);
  }
  CHECK(report->errors == 0);
}

}  // namespace

TEST_CASE("recover leaves an intact file as it was") {
  const Bytes file = shipped();
  const Recovered result = recovered(file);
  CHECK(result.bytes == file);
  CHECK(result.report.clean());
  CHECK(result.report.damaged_bytes == 0);
  CHECK(result.report.tracks.empty());
}

TEST_CASE("recover keeps every segment that ten bursts of damage did not hit") {
  const Bytes file = shipped();
  const Read before = read_all(file);
  REQUIRE(before.segments.size() >= 4);
  REQUIRE(before.contents.clips.front().frame_count >= 100);
  for (std::uint32_t trial = 0; trial < 20; ++trial) {
    INFO("trial " << trial);
    std::mt19937 random(trial);
    std::vector<Burst> bursts;
    Bytes damaged = file;
    const std::uint64_t length = file.size() / 1000;
    for (int i = 0; i < 10; ++i) {
      const std::uint64_t at = random() % (file.size() - length);
      bursts.emplace_back(at, at + length);
      damage(damaged, bursts.back(), random);
    }
    auto result = try_recover(damaged);
    REQUIRE(result);
    validates(result->bytes);
    const Read after = read_all(result->bytes);
    CHECK(after.finished);
    for (const PlacedSegment& s : before.segments) {
      const PlacedSegment* kept = segment_at(after, s.segment.first_frame);
      if (hits(bursts, s.begin, s.end)) continue;
      INFO("segment " << s.segment.index);
      REQUIRE(kept != nullptr);
      CHECK(same_segment(s, *kept));
    }
    check_decodes(result->bytes, after, before.segments.front().chunks.size());
    // What has been recovered is whole.
    const Recovered again = recovered(result->bytes);
    CHECK(again.bytes == result->bytes);
    CHECK(again.report.clean());
  }
}

TEST_CASE("recover takes each static record from its copy, with and without an end") {
  const Bytes file = shipped();
  const Read before = read_all(file);
  for (const Placed& record : records_of(file)) {
    if (order_of(record.header.type) >= order_of(types::kSegment) || record.copy()) continue;
    INFO(type_name(record.header.type) << " at " << record.offset);
    std::mt19937 random(1);
    Bytes damaged = file;
    // Alternately the header, which costs the framing, and the payload.
    const std::uint64_t at =
        record.offset + (record.offset / 8 % 2 == 0 ? 5 : kRecordHeaderBytes + 1);
    damage(damaged, {at, at + 3}, random);
    if (record.offset % 3 == 0) damaged.resize(damaged.size() - 40);
    const Recovered result = recovered(damaged);
    CHECK(result.bytes == file);
    CHECK(result.report.clean());
    CHECK(result.report.repaired.size() == 1);
  }
}

TEST_CASE("recover tells what is missing when a static record and its copy are hit") {
  const Bytes file = shipped();
  const auto records = records_of(file);
  const auto hit_both = [&](RecordType type, std::size_t which, bool framing) {
    Bytes damaged = file;
    std::mt19937 random(2);
    for (const bool copy : {false, true}) {
      std::size_t n = 0;
      for (const Placed& r : records)
        if (r.header.type == type && r.copy() == copy && n++ == which) {
          const std::uint64_t at = r.offset + (framing ? 2 : kRecordHeaderBytes + 2);
          damage(damaged, {at, at + 4}, random);
        }
    }
    return damaged;
  };
  const Read before = read_all(file);
  for (const bool framing : {false, true}) {
    INFO("framing lost: " << framing);
    {
      const Recovered result = recovered(hit_both(types::kImage, 0, framing));
      const Read after = read_all(result.bytes);
      CHECK_FALSE(result.report.clean());
      CHECK(after.contents.images.size() + 1 == before.contents.images.size());
      CHECK(after.contents.materials.size() == before.contents.materials.size());
      CHECK(after.segments.size() == before.segments.size());
    }
    {
      const Recovered result = recovered(hit_both(types::kMaterial, 0, framing));
      const Read after = read_all(result.bytes);
      CHECK_FALSE(result.report.clean());
      CHECK(after.contents.meshes == before.contents.meshes);
    }
    {
      const Recovered result = recovered(hit_both(types::kMesh, 3, framing));
      const Read after = read_all(result.bytes);
      CHECK_FALSE(result.report.clean());
      CHECK(after.contents.meshes.size() + 1 == before.contents.meshes.size());
      CHECK(after.segments.size() == before.segments.size());
      check_decodes(result.bytes, after, 4);
    }
    {
      const Recovered result = recovered(hit_both(types::kLayer, 1, framing));
      const Read after = read_all(result.bytes);
      CHECK_FALSE(result.report.clean());
      CHECK(after.contents.layers.size() + 1 == before.contents.layers.size());
      CHECK(after.segments.front().chunks.size() + 1 == before.segments.front().chunks.size());
    }
    {
      const Recovered result = recovered(hit_both(types::kLayer, 0, framing));
      const Read after = read_all(result.bytes);
      CHECK(after.contents.models.empty());
      CHECK(after.contents.pose_tracks == before.contents.pose_tracks);
      CHECK(after.segments.front().chunks.size() == 1);
    }
    {
      const Recovered result = recovered(hit_both(types::kHeader, 0, framing));
      CHECK_FALSE(result.report.clean());
      CHECK(read_all(result.bytes).segments.size() == before.segments.size());
    }
    for (const RecordType type : {types::kPoseTrack, types::kClip, types::kSkeleton}) {
      INFO(type_name(type));
      const auto nothing = try_recover(hit_both(type, 0, framing));
      REQUIRE_FALSE(nothing);
      CHECK(nothing.error().code == ErrorCode::kCorrupt);
      CHECK(nothing.error().message.find("nothing usable") == 0);
    }
  }
}

TEST_CASE("recover keeps what a cut file still holds") {
  const Bytes file = shipped();
  const Read before = read_all(file);
  const std::uint64_t first = before.segments.front().begin;
  std::mt19937 random(3);
  for (int i = 0; i < 24; ++i) {
    const std::uint64_t length = i < 4 ? first * static_cast<std::uint64_t>(i) / 4
                                       : first + random() % (file.size() - first);
    INFO("cut at " << length);
    const Bytes cut(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(length));
    const std::size_t whole = static_cast<std::size_t>(std::ranges::count_if(
        before.segments, [&](const PlacedSegment& s) { return s.end <= length; }));
    auto result = try_recover(cut);
    if (!result) {
      CHECK(whole == 0);
      continue;
    }
    const Read after = read_all(result->bytes);
    CHECK(same_static(after.contents, before.contents));
    CHECK(after.segments.size() >= whole);
    CHECK(after.segments.size() <= whole + 1);
    for (std::size_t k = 0; k < whole; ++k)
      CHECK(same_segment(before.segments[k], after.segments[k]));
    CHECK(result->report.clean() == (whole == before.segments.size()));
    CHECK(result->report.tracks.empty() == (whole == before.segments.size()));
  }
}

TEST_CASE("recover keeps the complete chunks of the segment in which a file was cut") {
  const Bytes file = shipped();
  const Read before = read_all(file);
  const auto& last = before.segments[1];
  // The pose and the first layer are there, the last layer is not.
  std::uint64_t length = last.begin + record_bytes(serialize(last.segment).size());
  for (std::size_t i = 0; i + 1 < last.segment.chunks.size(); ++i)
    length += last.segment.chunks[i].chunk_bytes;
  const Bytes cut(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(length + 100));
  const Recovered result = recovered(cut);
  const Read after = read_all(result.bytes);
  REQUIRE(after.segments.size() == 2);
  CHECK(after.segments[1].chunks.size() + 1 == last.chunks.size());
  CHECK(result.report.partial_segments == 1);
  REQUIRE(result.report.tracks.size() == last.chunks.size());
  CHECK(result.report.tracks.front().frames.front().first ==
        last.segment.first_frame + last.segment.frame_count);
  CHECK(result.report.tracks.back().frames.front().first == last.segment.first_frame);
}

TEST_CASE("recover drops a damaged chunk alone, or with its segment where nothing could be shown") {
  const Bytes file = shipped();
  const Read before = read_all(file);
  const PlacedSegment& second = before.segments[1];
  std::uint64_t at = second.begin + record_bytes(serialize(second.segment).size());
  for (std::size_t i = 0; i < second.segment.chunks.size(); ++i) {
    INFO("chunk " << i);
    Bytes damaged = file;
    std::mt19937 random(4);
    // The header, so that the chunks behind it must be found by themselves.
    damage(damaged, {at + 1, at + 30}, random);
    const Recovered result = recovered(damaged);
    const Read after = read_all(result.bytes);
    const PlacedSegment* kept = segment_at(after, second.segment.first_frame);
    CHECK_FALSE(result.report.clean());
    CHECK((kept != nullptr) == (i >= 2));
    if (kept != nullptr) CHECK(kept->chunks.size() + 1 == second.chunks.size());
    CHECK(after.segments.size() == before.segments.size() - (i < 2 ? 1 : 0));
    const FrameRun span{second.segment.first_frame,
                        second.segment.first_frame + second.segment.frame_count - 1};
    for (const TrackLoss& track : result.report.tracks)
      CHECK(track.frames == std::vector<FrameRun>{span});
    CHECK(result.report.tracks.size() == (i < 2 ? second.chunks.size() : 1));
    at += second.segment.chunks[i].chunk_bytes;
  }
}

TEST_CASE("recover rebuilds a segment record from the index") {
  const Bytes file = shipped();
  const Read before = read_all(file);
  Bytes damaged = file;
  std::mt19937 random(5);
  const std::uint64_t at = before.segments[1].begin;
  damage(damaged, {at, at + 120}, random);
  const Recovered result = recovered(damaged);
  const Read after = read_all(result.bytes);
  REQUIRE(after.segments.size() == before.segments.size());
  CHECK(same_segment(before.segments[1], after.segments[1]));
}

TEST_CASE("recover needs neither end, index nor the first bytes") {
  const Bytes file = shipped();
  const auto records = records_of(file);
  const Placed index = records[records.size() - 2], end = records.back();
  for (const Burst& burst :
       {Burst{end.offset, end.end}, Burst{end.offset + 30, end.end}, Burst{index.offset, index.end},
        Burst{index.offset + 30, index.end}, Burst{0, 8}, Burst{0, 64}, Burst{8, 40},
        Burst{index.offset, end.end}, Burst{0, 200}}) {
    INFO(burst.first << " to " << burst.second);
    Bytes damaged = file;
    std::mt19937 random(6);
    damage(damaged, burst, random);
    const Recovered result = recovered(damaged);
    CHECK(result.bytes == file);
    CHECK(result.report.clean());
  }
}

TEST_CASE("recover finds records that have moved to odd places") {
  Bytes file = shipped();
  const Read before = read_all(file);
  Bytes longer = file;
  const auto at = static_cast<std::ptrdiff_t>(before.segments[1].begin + 300);
  longer.insert(longer.begin() + at, {1, 2, 3});
  Bytes shorter = file;
  shorter.erase(shorter.begin() + at, shorter.begin() + at + 5);
  for (const Bytes& moved : {longer, shorter}) {
    const Recovered result = recovered(moved);
    const Read after = read_all(result.bytes);
    for (const PlacedSegment& s : before.segments) {
      if (s.segment.index == 1) continue;
      const PlacedSegment* kept = segment_at(after, s.segment.first_frame);
      REQUIRE(kept != nullptr);
      CHECK(same_segment(s, *kept));
    }
  }
}

TEST_CASE("whatever happened to a file, what recover writes is whole", "[long]") {
  const Bytes file = shipped();
  int written = 0;
  for (std::uint32_t trial = 0; trial < 80; ++trial) {
    INFO("trial " << trial);
    std::mt19937 random(1000 + trial);
    Bytes damaged = file;
    for (std::uint64_t i = random() % 40; i > 0; --i) {
      const std::uint64_t length = 1 + random() % (random() % 4 == 0 ? 20'000 : 200);
      const std::uint64_t at = random() % (damaged.size() - length);
      const auto begin = damaged.begin() + static_cast<std::ptrdiff_t>(at);
      switch (random() % 4) {
        case 0:
          damaged.erase(begin, begin + static_cast<std::ptrdiff_t>(length));
          break;
        case 1:
          damaged.insert(begin, length, static_cast<std::uint8_t>(random()));
          break;
        default:
          damage(damaged, {at, at + length}, random);
      }
    }
    const auto result = try_recover(damaged);
    if (!result) {
      CHECK(result.error().code == ErrorCode::kCorrupt);
      continue;
    }
    ++written;
    validates(result->bytes);
    const Read after = read_all(result->bytes);
    CHECK(after.finished);
    CHECK(after.segments.size() == result->report.segments);
    if (after.contents.models.empty()) continue;
    check_decodes(result->bytes, after, 1 + after.contents.layers.size());
  }
  CHECK(written > 20);
}

TEST_CASE("recover ignores what is glued on behind the end") {
  const Bytes file = shipped();
  Bytes twice = file;
  twice.insert(twice.end(), file.begin(), file.end());
  CHECK(recovered(twice).bytes == file);
}

TEST_CASE("recover refuses what holds nothing of a .relit file") {
  std::mt19937 random(7);
  Bytes noise(300'000), text;
  for (auto& b : noise) b = static_cast<std::uint8_t>(random());
  while (text.size() < 300'000)
    for (const char c : std::string("HEAD CLIP of a Text that SEGMents nothing\n"))
      text.push_back(static_cast<std::uint8_t>(c));
  for (const Bytes& bad : {Bytes{}, Bytes{0x89}, Bytes(8, 0), noise, text,
                           Bytes(kSignature.begin(), kSignature.end())}) {
    const auto result = try_recover(bad);
    REQUIRE_FALSE(result);
    CHECK(result.error().code == ErrorCode::kCorrupt);
  }
}

TEST_CASE("recover's work stays linear where records pretend to hold records") {
  // Each header announces a payload that reaches to the end and matches nothing.
  Bytes nested(kSignature.begin(), kSignature.end());
  constexpr std::size_t kRecords = 20'000;
  for (std::size_t i = 0; i < kRecords; ++i) {
    const auto header =
        encode_header({types::kImage, 0, (kRecords - i) * kRecordHeaderBytes + 100'000, 1});
    nested.insert(nested.end(), header.begin(), header.end());
  }
  CHECK_FALSE(try_recover(nested));
}

TEST_CASE("the recover command's exit statuses and JSON") {
  const Folder folder;
  const std::string in = folder.file("in.relit"), out = folder.file("out.relit");
  const auto write = [&](const Bytes& bytes) {
    std::ofstream(in, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  };
  Bytes file = shipped();
  write(file);
  CHECK(run_relit("recover " + in + " " + out) == 0);
  CHECK(read_bytes(out) == file);
  const Read before = read_all(file);
  file.resize(before.segments[1].end);
  write(file);
  std::string says;
  CHECK(run_relit("recover --json " + in + " " + out, &says) == 3);
  CHECK(says.find("\"missing_frames\"") != std::string::npos);
  CHECK(read_all(read_bytes(out)).segments.size() == 2);
  std::filesystem::remove(out);
  file.resize(1000);
  write(file);
  CHECK(run_relit("recover " + in + " " + out, &says) == 1);
  CHECK(says.find("nothing usable") != std::string::npos);
  CHECK_FALSE(std::filesystem::exists(out));
  CHECK(run_relit("recover " + in + "x " + out) == 1);
}
