// SPDX-License-Identifier: MIT
#include "container/reader.hpp"

#include <algorithm>
#include <functional>

#include "container/record_codec.hpp"
#include "tests/container/sample.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::container;
using sample::Bytes;
using sample::memory;
using sample::read_everything;
using sample::same;

namespace {

Bytes framed(const char (&type)[5], const Bytes& payload = {1, 2, 3}, std::uint32_t flags = 0) {
  return frame_record(record_type(type), payload, flags);
}

sample::Everything intact() { return read_everything(memory(sample::file())).value(); }

/// Everything that went well, or the first error.
Result<sample::Everything> strictly(Bytes bytes) {
  auto all = read_everything(memory(std::move(bytes)));
  if (all && !all->errors.empty()) return Unexpected{all->errors.front()};
  return all;
}

template <class R>
const R* only(const std::vector<RecordBody>& bodies, std::size_t n = 0) {
  for (const auto& body : bodies)
    if (const auto* record = std::get_if<R>(&body))
      if (n-- == 0) return record;
  return nullptr;
}

Reader opened_behind_static(std::unique_ptr<ByteSource> source) {
  auto reader = Reader::open(std::move(source));
  REQUIRE(reader);
  REQUIRE(load_static(*reader));
  return std::move(*reader);
}

}  // namespace

TEST_CASE("a file comes out as it was written") {
  const auto all = intact();
  CHECK(all.errors.empty());
  CHECK(all.finished);
  CHECK(all.contents.header.writer == "sample 1");
  CHECK(all.contents.clips == std::vector{sample::clip()});
  CHECK(all.contents.images == std::vector{sample::image()});
  CHECK(all.contents.materials == std::vector{sample::material()});
  CHECK(all.contents.meshes == std::vector{sample::mesh()});
  CHECK(all.contents.skeleton == sample::skeleton());
  CHECK(all.contents.pose_tracks == std::vector{sample::pose_track()});
  CHECK(all.contents.models == std::vector{sample::model()});
  CHECK(all.contents.layers == std::vector{sample::layer(), sample::second_layer()});
  CHECK(all.contents.layers_of(20).size() == 2);
  CHECK(all.contents.find_clip(7) == &all.contents.clips[0]);
  CHECK(all.contents.find_clip(8) == nullptr);
  REQUIRE(all.rest.size() == 3 * 5 + 2);
  const auto* segment = std::get_if<SegmentRecord>(&all.rest[5]);
  REQUIRE(segment != nullptr);
  CHECK(segment->index == 1);
  CHECK(segment->first_frame == 2);
  auto expected = sample::chunk(2, 2, 2);
  expected.segment_index = 1;
  CHECK(std::get<ChunkRecord>(all.rest[7]) == expected);
  CHECK(all.loss.damaged_records == 0);
  CHECK(all.loss.dropped_bytes == 0);
  CHECK(all.loss.missing_segments == 0);
}

TEST_CASE("a source that only goes forward gives the same") {
  for (const std::size_t step : {std::size_t{1}, std::size_t{7}, std::size_t{100000}}) {
    const auto all = read_everything(std::make_unique<sample::Pipe>(sample::file(), step));
    REQUIRE(all);
    CHECK(same(*all, intact()));
  }
}

TEST_CASE("the reader notices every truncation") {
  const Bytes file = sample::file();
  const auto whole = intact();
  for (std::size_t size = 0; size < file.size(); ++size) {
    const Bytes cut(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(size));
    for (const bool pipe : {false, true}) {
      auto source =
          pipe ? std::unique_ptr<ByteSource>(std::make_unique<sample::Pipe>(cut, 64)) : memory(cut);
      const auto all = read_everything(std::move(source));
      if (!all) continue;
      REQUIRE_FALSE(all->finished);
      // What was read is the beginning of the whole.
      REQUIRE(all->rest.size() < whole.rest.size());
      REQUIRE(std::equal(all->rest.begin(), all->rest.end(), whole.rest.begin()));
      REQUIRE(all->errors.size() <= 1);
      if (!all->errors.empty()) REQUIRE(all->errors[0].code == ErrorCode::kTruncated);
    }
  }
}

TEST_CASE("a file that was cut between segments plays to its last one") {
  Bytes file = sample::file();
  file.resize(sample::offset_of(file, types::kSegment, 2));
  const auto all = strictly(file);
  REQUIRE(all);
  CHECK_FALSE(all->finished);
  CHECK(all->rest.size() == 10);
}

TEST_CASE("a segment whose last chunks are missing is an error") {
  Bytes file = sample::file();
  file.resize(sample::offset_of(file, types::kChunk, 2));
  const auto all = read_everything(memory(file));
  REQUIRE(all);
  REQUIRE(all->errors.size() == 1);
  CHECK(all->errors[0].code == ErrorCode::kTruncated);
  CHECK(all->errors[0].message.find("inside segment 0") != std::string::npos);
}

TEST_CASE("no changed byte goes unnoticed", "[long]") {
  const Bytes file = sample::file();
  const auto whole = intact();
  for (std::size_t i = 0; i < file.size(); ++i) {
    for (const int change : {0x01, 0x20, 0x80, 0xFF}) {
      Bytes changed = file;
      changed[i] = static_cast<std::uint8_t>(changed[i] ^ change);
      const auto all = read_everything(memory(changed));
      if (!all) continue;
      const bool noticed = !all->errors.empty();
      REQUIRE((noticed || same(*all, whole)));
      // Damage never brings forth what was not in the file.
      for (const auto& body : all->rest)
        REQUIRE(std::ranges::find(whole.rest, body) != whole.rest.end());
    }
  }
}

TEST_CASE("bytes behind the end record are an error") {
  const Bytes file = sample::file();
  for (const std::size_t extra :
       {std::size_t{1}, std::size_t{8}, std::size_t{24}, std::size_t{64}}) {
    Bytes longer = file;
    longer.resize(file.size() + extra);
    const auto all = strictly(longer);
    REQUIRE_FALSE(all);
    CHECK(all.error().code == ErrorCode::kCorrupt);
  }
  // A whole record, and even one that could otherwise be ignored.
  for (const Bytes& more : {framed("noTe"), Bytes(file.begin() + 8, file.end())}) {
    const auto all = strictly(sample::with_inserted(file, file.size(), more));
    REQUIRE_FALSE(all);
    CHECK(all.error().message.find("behind the end") != std::string::npos);
  }
}

TEST_CASE("other files are told by their signature") {
  const auto code = [](Bytes bytes) { return Reader::open(memory(std::move(bytes))).error(); };
  CHECK(code({}).code == ErrorCode::kTruncated);
  CHECK(code({0x89, 'P', 'N', 'G', 13, 10, 26, 10, 0}).message.find("not a .relit file") !=
        std::string::npos);
  Bytes text = sample::file();
  text.erase(text.begin() + 4);  // CR LF became LF
  CHECK(code(text).message.find("text mode") != std::string::npos);
}

TEST_CASE("newer minor versions are read, newer major versions are refused") {
  const Bytes file = sample::file();
  const auto body = sample::offset_of(file, types::kClip);
  const auto with_version = [&](std::uint16_t major, std::uint16_t minor) {
    Bytes result(kSignature.begin(), kSignature.end());
    const auto header =
        frame_record(types::kHeader, serialize(HeaderRecord{major, minor, "sample 1"}));
    result.insert(result.end(), header.begin(), header.end());
    result.insert(result.end(), file.begin() + static_cast<std::ptrdiff_t>(body), file.end());
    return result;
  };
  const auto minor = strictly(with_version(kVersionMajor, 99));
  REQUIRE(minor);
  CHECK(minor->contents.header.version_minor == 99);
  CHECK(minor->rest == intact().rest);
  const auto major = strictly(with_version(kVersionMajor + 1, 0));
  REQUIRE_FALSE(major);
  CHECK(major.error().code == ErrorCode::kUnsupported);
  CHECK(major.error().message.find("'HEAD' at byte 8") != std::string::npos);
}

TEST_CASE("unknown ancillary records are passed over, unknown critical ones are named") {
  const Bytes file = sample::file();
  const auto whole = intact();
  for (const auto offset : sample::record_offsets(file)) {
    const auto type = sample::type_at(file, offset);
    // Offsets in the index and the end record move along only in the static part's favour: put the
    // records in front of the segments, where the file's own checks do not notice before the end.
    const auto ancillary =
        read_everything(memory(sample::with_inserted(file, offset, framed("noTe"))));
    if (offset == kSignature.size()) {
      REQUIRE_FALSE(ancillary);
      continue;
    }
    if (type == types::kChunk) {
      REQUIRE(ancillary);
      REQUIRE_FALSE(ancillary->errors.empty());
      continue;
    }
    REQUIRE(ancillary);
    CHECK(same(ancillary->contents, whole.contents));
    CHECK(ancillary->rest.size() + ancillary->errors.size() == whole.rest.size());
    // Only the end record's own claims about the file are wrong now.
    REQUIRE(ancillary->errors.size() == 1);
    CHECK(ancillary->errors[0].message.find("'FEND'") != std::string::npos);

    const auto critical = strictly(sample::with_inserted(file, offset, framed("NoTE")));
    REQUIRE_FALSE(critical);
    CHECK(critical.error().code == ErrorCode::kUnsupported);
    CHECK(critical.error().message.find("'NoTE' at byte " + std::to_string(offset)) !=
          std::string::npos);
  }
}

TEST_CASE("a critical record that is unknown cannot be read past") {
  const Bytes file = sample::file();
  const auto offset = sample::offset_of(file, types::kSegment, 1);
  auto reader = opened_behind_static(memory(sample::with_inserted(file, offset, framed("NoTE"))));
  for (int i = 0; i < 5; ++i) REQUIRE(reader.next());
  for (int i = 0; i < 2; ++i) CHECK(reader.next().error().code == ErrorCode::kUnsupported);
  CHECK_FALSE(reader.can_continue());
  CHECK(reader.resync().error().code == ErrorCode::kUnsupported);
}

TEST_CASE("flags decide whether a known record may be used") {
  const Bytes file = sample::file();
  const auto offset = sample::offset_of(file, types::kImage);
  const auto clip = serialize(sample::clip(8));
  const auto with_flags = [&](std::uint32_t flags) {
    return read_everything(
        memory(sample::with_inserted(file, offset, frame_record(types::kClip, clip, flags))));
  };
  const auto ignorable = with_flags(0xFFFF0000u);
  REQUIRE(ignorable);
  CHECK(ignorable->contents.clips.size() == 2);
  const auto unknown = with_flags(0x8000);
  REQUIRE_FALSE(unknown);
  CHECK(unknown.error().code == ErrorCode::kUnsupported);
  const auto copy = with_flags(flags::kCopy);
  REQUIRE(copy);
  CHECK(copy->contents.clips.size() == 1);
  // A copy may stand anywhere between the records.
  const auto late = read_everything(
      memory(sample::with_inserted(file, sample::offset_of(file, types::kIndex),
                                   frame_record(types::kClip, clip, flags::kCopy))));
  REQUIRE(late);
  REQUIRE(late->errors.size() == 1);
  CHECK(late->errors[0].message.find("'FEND'") != std::string::npos);
}

TEST_CASE("records out of their place are errors") {
  const Bytes file = sample::file();
  const auto refused = [&](std::uint64_t at, RecordType type, const Bytes& payload) {
    const auto all = strictly(sample::with_inserted(file, at, frame_record(type, payload)));
    REQUIRE_FALSE(all);
    CHECK(all.error().code == ErrorCode::kCorrupt);
    return all.error().message;
  };
  const auto clip = serialize(sample::clip(8));
  CHECK(refused(sample::offset_of(file, types::kMaterial), types::kClip, clip)
            .find("out of its place") != std::string::npos);
  refused(sample::offset_of(file, types::kSegment, 1), types::kClip, clip);
  refused(sample::offset_of(file, types::kChunk, 1), types::kClip, clip);
  refused(sample::offset_of(file, types::kClip), types::kHeader, serialize(HeaderRecord{}));
  refused(sample::offset_of(file, types::kPoseTrack), types::kSkeleton,
          serialize(SkeletonRecord{}));
  refused(sample::offset_of(file, types::kSegment), types::kChunk,
          serialize(sample::chunk(2, 0, 1)));
  refused(sample::offset_of(file, types::kEnd), types::kIndex, serialize(IndexRecord{}));
}

TEST_CASE("chunks that are not what their segment announces are errors") {
  const Bytes file = sample::file();
  const auto at = sample::offset_of(file, types::kChunk, 1);
  const auto size = sample::offset_of(file, types::kChunk, 2) - at;
  const auto spoiled = [&](const std::function<void(ChunkRecord&)>& spoil) {
    auto chunk = sample::chunk(2, 0, 2);
    spoil(chunk);
    const auto record = frame_record(types::kChunk, serialize(chunk));
    Bytes changed = file;
    REQUIRE(record.size() == size);
    std::ranges::copy(record, changed.begin() + static_cast<std::ptrdiff_t>(at));
    auto all = read_everything(memory(changed));
    REQUIRE(all);
    // Nothing but this chunk is lost.
    CHECK(all->rest.size() == 3 * 5 + 2 - (all->errors.empty() ? 0u : 1u));
    return all->errors.size();
  };
  CHECK(spoiled([](ChunkRecord&) {}) == 0);
  CHECK(spoiled([](ChunkRecord& c) { c.track_id = 3; }) == 1);
  CHECK(spoiled([](ChunkRecord& c) { c.segment_index = 1; }) == 1);
  CHECK(spoiled([](ChunkRecord& c) { c.packets[0].key = false; }) == 1);
  CHECK(spoiled([](ChunkRecord& c) {
          c.packets[0].pts = 1;
          c.packets[1].pts = 0;
        }) == 1);
  CHECK(spoiled([](ChunkRecord& c) { c.packets[1].pts = 2; }) == 1);
}

TEST_CASE("chunks of unwanted tracks are passed over") {
  for (const bool pipe : {false, true}) {
    auto reader = opened_behind_static(
        pipe ? std::unique_ptr<ByteSource>(std::make_unique<sample::Pipe>(sample::file()))
             : memory(sample::file()));
    reader.set_wanted_tracks({{4, 1}});
    std::vector<std::uint32_t> tracks;
    for (;;) {
      auto record = reader.next();
      REQUIRE(record);
      if (!*record) break;
      if (const auto* chunk = std::get_if<ChunkRecord>(&(**record).body))
        tracks.push_back(chunk->track_id);
    }
    CHECK(tracks == std::vector<std::uint32_t>{1, 4, 1, 4, 1, 4});
    CHECK(reader.finished());
    CHECK(reader.loss().dropped_bytes == 0);
  }
}

namespace {

/// Counts what is really read.
class CountingSource final : public ByteSource {
 public:
  CountingSource(Bytes bytes, std::uint64_t& read_bytes)
      : inner_(std::move(bytes)), read_bytes_(read_bytes) {}
  Result<std::size_t> read(std::span<std::uint8_t> out) override {
    auto got = inner_.read(out);
    if (got) read_bytes_ += *got;
    return got;
  }
  std::optional<std::uint64_t> size() const override { return inner_.size(); }
  bool seekable() const override { return true; }
  Status seek(std::uint64_t offset) override { return inner_.seek(offset); }

 private:
  MemorySource inner_;
  std::uint64_t& read_bytes_;
};

/// One clip of two segments with a chunk of 1 MiB each.
Bytes big_file() {
  MemorySink sink;
  auto writer = Writer::create(sink, "big").value();
  sample::add_static(writer);
  for (const std::uint64_t first : {0ull, 3ull}) {
    const std::uint32_t frames = first == 0 ? 3 : 2;
    auto chunks = sample::chunks(first, frames);
    auto& big = chunks[1];
    big.data.resize(1 << 20);
    big.packets.back().size = big.data.size() - big.packets.back().offset;
    REQUIRE(writer.write_segment({7, first, frames}, chunks));
  }
  REQUIRE(writer.finish());
  return sink.take();
}

}  // namespace

TEST_CASE("large chunks that are not wanted are not read") {
  const Bytes file = big_file();
  std::uint64_t read_bytes = 0;
  auto reader = opened_behind_static(std::make_unique<CountingSource>(file, read_bytes));
  reader.set_wanted_tracks({{1, 3, 4}});
  while (reader.next().value()) {
  }
  CHECK(reader.finished());
  CHECK(read_bytes < file.size() - (2 << 20) + 1);

  // The same, cut inside a chunk that is passed over: a seek beyond the end must not hide it.
  Bytes cut = file;
  cut.resize(sample::offset_of(file, types::kChunk, 5) + 1000);
  auto cut_reader = opened_behind_static(memory(cut));
  cut_reader.set_wanted_tracks(std::vector<std::uint32_t>{});
  CHECK(cut_reader.next().value());
  CHECK(cut_reader.next().value());
  CHECK(cut_reader.next().error().code == ErrorCode::kTruncated);
}

TEST_CASE("the rest of a segment can be passed over") {
  auto reader = opened_behind_static(memory(sample::file()));
  for (std::uint32_t index = 0; index < 3; ++index) {
    const auto record = reader.next().value();
    REQUIRE(record);
    CHECK(std::get<SegmentRecord>(record->body).index == index);
    if (index == 1) REQUIRE(reader.next().value());
    reader.skip_segment();
  }
  CHECK(reader.next().value()->type == types::kIndex);
}

TEST_CASE("the index is found from the end and leads to every segment") {
  const Bytes file = sample::file();
  auto reader = opened_behind_static(memory(file));
  REQUIRE(reader.next().value());
  const auto index = reader.read_index();
  REQUIRE(index);
  REQUIRE(index->segments.size() == 3);
  CHECK(index->segments[2].first_frame == 4);
  // Reading the index moved nothing.
  CHECK(std::get<ChunkRecord>(reader.next().value()->body).track_id == 1);
  for (const int i : {2, 0, 1, 1}) {
    REQUIRE(reader.seek_to_segment(index->segments[static_cast<std::size_t>(i)]));
    const auto record = reader.next().value();
    REQUIRE(record);
    CHECK(record->offset_bytes == sample::offset_of(file, types::kSegment, i));
    CHECK(std::get<SegmentRecord>(record->body).index == static_cast<std::uint32_t>(i));
    CHECK(std::get<ChunkRecord>(reader.next().value()->body).track_id == 1);
  }
  while (reader.next().value()) {
  }
  CHECK(reader.finished());
  CHECK(reader.loss().missing_segments == 0);
}

TEST_CASE("an index that lies is found out") {
  const Bytes file = sample::file();
  auto reader = opened_behind_static(memory(file));
  auto entry = reader.read_index().value().segments[1];
  auto wrong = entry;
  wrong.offset += 8;
  CHECK(reader.seek_to_segment(wrong).error().code == ErrorCode::kCorrupt);
  CHECK_FALSE(reader.can_continue());
  wrong = entry;
  wrong.offset = sample::offset_of(file, types::kChunk, 0);
  CHECK(reader.seek_to_segment(wrong).error().code == ErrorCode::kCorrupt);
  wrong.offset = file.size() + 800;
  CHECK_FALSE(reader.seek_to_segment(wrong));
  wrong = entry;
  wrong.first_frame = 3;
  REQUIRE(reader.seek_to_segment(wrong));
  CHECK(reader.next().error().code == ErrorCode::kCorrupt);
  REQUIRE(reader.seek_to_segment(entry));
  CHECK(reader.next());
}

TEST_CASE("files without an index, and sources that cannot seek, say so") {
  Bytes cut = sample::file();
  cut.resize(cut.size() - 40);
  CHECK(opened_behind_static(memory(cut)).read_index().error().code == ErrorCode::kNotFound);
  cut.resize(cut.size() - 3);
  CHECK(opened_behind_static(memory(cut)).read_index().error().code == ErrorCode::kNotFound);
  auto pipe = opened_behind_static(std::make_unique<sample::Pipe>(sample::file()));
  CHECK(pipe.read_index().error().code == ErrorCode::kUnsupported);
  CHECK(pipe.seek_to_segment({}).error().code == ErrorCode::kUnsupported);
  CHECK(pipe.next().value()->type == types::kSegment);
}

TEST_CASE("options tighten the limits") {
  ReaderOptions options;
  options.max_static_bytes = 100;
  auto all = read_everything(memory(sample::file()), options);
  REQUIRE_FALSE(all);
  CHECK(all.error().code == ErrorCode::kLimit);
  options = {};
  options.max_record_bytes = 1 << 16;
  all = read_everything(memory(big_file()), options);
  REQUIRE(all);
  REQUIRE(all->errors.size() == 2);
  CHECK(all->errors[0].code == ErrorCode::kLimit);
  CHECK(all->finished);
  CHECK(all->rest.size() == 2 * 4 + 2);
}

TEST_CASE("a header that promises a gigabyte costs no more than what comes") {
  Bytes file = sample::file();
  const auto at = sample::offset_of(file, types::kImage);
  file.resize(at);
  const auto header = encode_header({types::kImage, 0, limits::kRecordBytes, 0});
  file.insert(file.end(), header.begin(), header.end());
  file.resize(file.size() + 1000);
  const auto all = read_everything(std::make_unique<sample::Pipe>(file, 4096));
  REQUIRE_FALSE(all);
  CHECK(all.error().code == ErrorCode::kTruncated);
  CHECK(all.error().message.find("'IMAG' at byte " + std::to_string(at)) != std::string::npos);
}

TEST_CASE("a file without segments has its copies behind the static part") {
  MemorySink sink;
  auto writer = Writer::create(sink, "sample 1");
  REQUIRE(writer);
  REQUIRE(writer->add(sample::clip()));
  REQUIRE(writer->finish());
  const auto all = sample::read_everything(sample::memory(sink.take()));
  REQUIRE(all);
  CHECK(all->errors.empty());
  CHECK(all->finished);
}

namespace {

/// A file of CLIP records of no more than 110 bytes each, all with these flags.
Bytes file_of_clips(std::uint32_t count, std::uint32_t record_flags) {
  Bytes file(kSignature.begin(), kSignature.end());
  const auto add = [&](RecordType type, const Bytes& payload, std::uint32_t its_flags) {
    const Bytes record = frame_record(type, payload, its_flags);
    file.insert(file.end(), record.begin(), record.end());
  };
  add(types::kHeader, serialize(HeaderRecord{}), 0);
  const std::uint64_t clips = file.size();
  for (std::uint32_t id = 0; id < count; ++id)
    add(types::kClip, serialize(sample::clip(id)), record_flags);
  const std::uint64_t whole = file.size() + record_bytes(kEndPayloadBytes);
  add(types::kEnd, serialize(EndRecord{0, whole, record_flags == 0 ? 0 : clips}), 0);
  return file;
}

}  // namespace

TEST_CASE("more records before the first segment than can be valid are not kept") {
  // Each takes several times its bytes in memory; which of them are wrong would be found only
  // behind the last.
  const auto many = read_everything(memory(file_of_clips(limits::kStaticRecords + 1, 0)));
  REQUIRE_FALSE(many);
  CHECK(many.error().code == ErrorCode::kLimit);
  const auto fewer = read_everything(memory(file_of_clips(limits::kClips, 0)));
  CHECK(fewer);
  auto reader =
      Reader::open(memory(file_of_clips(limits::kStaticRecords + 1, flags::kCopy))).value();
  CHECK(reader.read_copies().error().code == ErrorCode::kLimit);
  reader = Reader::open(memory(file_of_clips(3, flags::kCopy))).value();
  CHECK(reader.read_copies().value().size() == 3);
}
