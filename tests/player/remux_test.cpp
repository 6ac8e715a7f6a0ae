// SPDX-License-Identifier: MIT
#include "player/remux.hpp"

#include <algorithm>

#include "container/record_codec.hpp"
#include "player/concat.hpp"
#include "tests/player/damage.hpp"
#include "tests/player/files.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::player;
using namespace relit::player::test;
using namespace relit::container;

namespace {

Bytes shipped() { return read_bytes(shipped_clip()); }

/// Bytes that can only be read forward, as from a pipe.
class PipeSource final : public ByteSource {
 public:
  explicit PipeSource(Bytes bytes) : inner_(std::move(bytes)) {}
  Result<std::size_t> read(std::span<std::uint8_t> out) override { return inner_.read(out); }

 private:
  MemorySource inner_;
};

Result<RewriteSource> open(const Bytes& file, bool pipe = false) {
  std::unique_ptr<ByteSource> source;
  if (pipe)
    source = std::make_unique<PipeSource>(file);
  else
    source = std::make_unique<MemorySource>(file);
  return RewriteSource::open(std::move(source), "file");
}

Result<Bytes> try_remux(const Bytes& file, const RemuxOptions& options, bool pipe = false) {
  RELIT_ASSIGN(RewriteSource source, open(file, pipe));
  MemorySink sink;
  RELIT_TRY(remux(source, sink, options));
  return sink.take();
}

Bytes remuxed(const Bytes& file, const RemuxOptions& options, bool pipe = false) {
  auto result = try_remux(file, options, pipe);
  if (!result) FAIL(result.error().message);
  return std::move(*result);
}

Result<Bytes> try_concat(const std::vector<Bytes>& files) {
  std::vector<RewriteSource> sources;
  for (const Bytes& file : files) {
    RELIT_ASSIGN(RewriteSource source, open(file));
    sources.push_back(std::move(source));
  }
  MemorySink sink;
  RELIT_TRY(concat(sources, sink));
  return sink.take();
}

Bytes joined(const std::vector<Bytes>& files) {
  auto result = try_concat(files);
  if (!result) FAIL(result.error().message);
  return std::move(*result);
}

/// The file written anew with another static part.
Bytes with_static(const Bytes& file, const FileContents& contents) {
  MemorySink sink;
  auto writer = Writer::create(sink, contents.header.writer);
  REQUIRE(writer);
  REQUIRE(write_static(*writer, contents));
  for (PlacedSegment& s : read_all(file).segments)
    REQUIRE(writer->write_segment({s.segment.clip_id, s.segment.first_frame, s.segment.frame_count},
                                  std::move(s.chunks)));
  REQUIRE(writer->finish());
  return sink.take();
}

std::vector<std::uint8_t> data_of(const PlacedSegment& segment, std::size_t chunk) {
  return segment.chunks.at(chunk).data;
}

}  // namespace

TEST_CASE("remux without a wish gives the same file, from a pipe too") {
  const Bytes file = shipped();
  CHECK(remuxed(file, {}) == file);
  CHECK(remuxed(file, {}, true) == file);
}

TEST_CASE("remux leaves copies out when asked to") {
  RemuxOptions options;
  options.copies = false;
  const Bytes file = shipped();
  const Bytes small = remuxed(file, options);
  CHECK(std::ranges::none_of(records_of(small), &Placed::copy));
  CHECK(remuxed(small, {}) == file);
}

TEST_CASE("remux keeps the first layers, or tracks by name") {
  const Bytes file = shipped();
  const Read before = read_all(file);
  RemuxOptions options;
  options.layers = 1;
  const Read one = read_all(remuxed(file, options));
  REQUIRE(one.contents.layers.size() == 1);
  CHECK(one.contents.layers.front() == before.contents.layers.front());
  for (std::size_t i = 0; i < before.segments.size(); ++i) {
    CHECK(one.segments[i].chunks.size() == 2);
    CHECK(data_of(one.segments[i], 1) == data_of(before.segments[i], 1));
  }
  options.layers = 0;
  const Read none = read_all(remuxed(file, options));
  CHECK(none.contents.models.empty());
  CHECK(none.segments.front().chunks.size() == 1);

  RemuxOptions tracks;
  tracks.tracks = {before.contents.layers[1].mantissa_track};
  const Read second = read_all(remuxed(file, tracks));
  CHECK(second.contents.pose_tracks.empty());
  REQUIRE(second.contents.layers.size() == 1);
  CHECK(data_of(second.segments[0], 0) == data_of(before.segments[0], 2));
  tracks.tracks = {4711};
  const auto absent = try_remux(file, tracks);
  REQUIRE_FALSE(absent);
  CHECK(absent.error().code == ErrorCode::kNotFound);
  CHECK(absent.error().message.find("4711") != std::string::npos);
}

TEST_CASE("remux cuts a range at segment borders and starts it with frame 0") {
  const Bytes file = shipped();
  const Read before = read_all(file);
  const SegmentRecord &second = before.segments[1].segment, &third = before.segments[2].segment;
  RemuxOptions options;
  options.frames = RemuxOptions::Frames{second.first_frame + 3, third.first_frame};
  const Bytes cut = remuxed(file, options);
  CHECK(remuxed(file, options, true) == cut);
  const Read after = read_all(cut);
  REQUIRE(after.segments.size() == 2);
  const ClipRecord& clip = after.contents.clips.front();
  CHECK(clip.frame_count == second.frame_count + third.frame_count);
  CHECK(clip.duration_ticks == clip.frame_count);
  CHECK_FALSE(clip.loop);
  CHECK(after.segments[0].segment.first_frame == 0);
  CHECK(after.segments[0].segment.first_tick == 0);
  CHECK(after.segments[1].segment.first_frame == second.frame_count);
  for (std::size_t i = 0; i < 2; ++i)
    for (std::size_t k = 0; k < before.segments[i + 1].chunks.size(); ++k)
      CHECK(data_of(after.segments[i], k) == data_of(before.segments[i + 1], k));

  // The same range by time: its borders belong to the segments outside only if they are crossed.
  const auto& rate = before.contents.clips.front().tick_rate;
  const double tick_s = static_cast<double>(rate.den) / static_cast<double>(rate.num);
  RemuxOptions seconds;
  seconds.seconds = RemuxOptions::Seconds{
      static_cast<double>(second.first_tick) * tick_s + 1e-6,
      static_cast<double>(third.first_tick + third.frame_count) * tick_s - 1e-6};
  CHECK(remuxed(file, seconds) == cut);

  options.frames = RemuxOptions::Frames{1'000'000, 1'000'001};
  const auto beyond = try_remux(file, options);
  REQUIRE_FALSE(beyond);
  CHECK(beyond.error().code == ErrorCode::kNotFound);
}

TEST_CASE("remux keeps unknown records only where their type allows it") {
  MemorySink sink;
  const Read before = read_all(shipped());
  auto writer = Writer::create(sink, "test");
  REQUIRE(writer);
  REQUIRE(write_static(*writer, before.contents));
  const std::vector<std::uint8_t> payload{1, 2, 3};
  REQUIRE(writer->add_ancillary(record_type("noTe"), payload));
  REQUIRE(writer->add_ancillary(record_type("noTE"), payload));
  for (const PlacedSegment& s : before.segments) {
    REQUIRE(writer->write_segment({s.segment.clip_id, s.segment.first_frame, s.segment.frame_count},
                                  s.chunks));
    REQUIRE(writer->add_ancillary(record_type("maRk"), payload));
  }
  REQUIRE(writer->finish());
  const auto count = [](const Bytes& file, RecordType type) {
    return std::ranges::count_if(records_of(file),
                                 [&](const Placed& r) { return r.header.type == type; });
  };
  const Bytes after = remuxed(sink.bytes(), {});
  CHECK(count(sink.bytes(), record_type("noTE")) == 1);
  CHECK(count(after, record_type("noTE")) == 0);
  CHECK(count(after, record_type("noTe")) == 1);
  CHECK(count(after, record_type("maRk")) == static_cast<std::ptrdiff_t>(before.segments.size()));
}

TEST_CASE("remux refuses damage and points to recover") {
  Bytes file = shipped();
  file.resize(file.size() * 2 / 3);
  const auto cut = try_remux(file, {});
  REQUIRE_FALSE(cut);
  CHECK(cut.error().message.find("relit recover") != std::string::npos);
}

TEST_CASE("concat plays one clip after the other, and remux takes them apart again") {
  const Bytes file = shipped();
  const Read before = read_all(file);
  const Bytes three = joined({file, file, file});
  const Read after = read_all(three);
  REQUIRE(after.contents.clips.size() == 3);
  const std::string name = before.contents.clips.front().name;
  CHECK(after.contents.clips[0].name == name);
  CHECK(after.contents.clips[1].name == name + " 2");
  CHECK(after.contents.clips[2].name == name + " 3");
  CHECK(after.contents.meshes == before.contents.meshes);
  CHECK(after.contents.images == before.contents.images);
  CHECK(after.contents.layers.size() == 3 * before.contents.layers.size());
  const std::size_t n = before.segments.size();
  REQUIRE(after.segments.size() == 3 * n);
  for (std::size_t i = 0; i < after.segments.size(); ++i) {
    CHECK(after.segments[i].segment.clip_id == after.contents.clips[i / n].id);
    for (std::size_t k = 0; k < before.segments[i % n].chunks.size(); ++k)
      CHECK(data_of(after.segments[i], k) == data_of(before.segments[i % n], k));
  }
  RemuxOptions first;
  first.clips = {name};
  CHECK(remuxed(three, first) == file);
  RemuxOptions last;
  last.clips = {name + " 3"};
  const Read apart = read_all(remuxed(three, last));
  CHECK(apart.contents.clips.size() == 1);
  CHECK(apart.segments.size() == n);
  RemuxOptions range;
  range.frames = RemuxOptions::Frames{0, 1};
  CHECK_FALSE(try_remux(three, range));
  range.clips = {"1"};
  CHECK(read_all(remuxed(three, range)).segments.size() == 1);
  RemuxOptions absent;
  absent.clips = {"swim"};
  const auto nothing = try_remux(three, absent);
  REQUIRE_FALSE(nothing);
  CHECK(nothing.error().code == ErrorCode::kNotFound);
  CHECK(nothing.error().message.find(name + " 2") != std::string::npos);
}

TEST_CASE("concat takes ids for names and contents for the character") {
  const Bytes file = shipped();
  FileContents contents = read_all(file).contents;
  REQUIRE_FALSE(contents.images.empty());
  FileContents other_ids = contents;
  for (auto& image : other_ids.images) image.id += 100;
  for (auto& material : other_ids.materials) {
    material.id += 200;
    if (material.image_id >= 0) material.image_id += 100;
  }
  for (auto& mesh : other_ids.meshes) mesh.id += 300, mesh.material_id += 200;
  CHECK(joined({file, with_static(file, other_ids)}) == joined({file, file}));

  FileContents other_mesh = contents;
  other_mesh.meshes[2].streams[0].scale[1] *= 2;
  const auto refused = try_concat({file, with_static(file, other_mesh)});
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == ErrorCode::kInvalid);
  CHECK(refused.error().message.find("mesh 2 \"" + contents.meshes[2].name + "\"") !=
        std::string::npos);
  FileContents other_skeleton = contents;
  other_skeleton.skeleton.nodes.push_back({});
  const auto skeleton = try_concat({file, with_static(file, other_skeleton)});
  REQUIRE_FALSE(skeleton);
  CHECK(skeleton.error().message.find("skeleton") != std::string::npos);
}

TEST_CASE("the remux and concat commands") {
  const Folder folder;
  const std::string clip = shipped_clip().string(), out = folder.file("out.relit");
  std::string says;
  CHECK(run_relit("remux " + clip + " " + out + " --layers 1 --tracks 1,2 --frames 30-40", &says) ==
        0);
  CHECK(says.find("kept frames") != std::string::npos);
  CHECK(read_all(read_bytes(out)).contents.layers.size() == 1);
  CHECK(run_relit("remux --clip swim " + clip + " " + out) == 2);
  CHECK(run_relit("remux --from 2 --to 1 " + clip + " " + out) == 2);
  CHECK(run_relit("remux - " + out + " <" + clip) == 0);
  CHECK(read_bytes(out) == shipped());
  CHECK(run_relit("concat " + clip + " " + clip + " -o " + out) == 0);
  CHECK(read_all(read_bytes(out)).contents.clips.size() == 2);
  CHECK(run_relit("concat " + clip + " -o " + out) == 2);
  CHECK(run_relit("concat - - -o " + out + " <" + clip) == 2);
}
