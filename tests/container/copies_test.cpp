// SPDX-License-Identifier: MIT
#include <algorithm>

#include "container/reader.hpp"
#include "container/record_codec.hpp"
#include "container/writer.hpp"
#include "tests/container/sample.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::container;
using sample::Bytes;
using sample::read_everything;

namespace {

const int kSegmentOrder = order_of(types::kSegment);

/// Offsets of the static records, or of their copies; the header is the first of either.
std::vector<std::uint64_t> statics(const Bytes& file, bool copies) {
  std::vector<std::uint64_t> found;
  for (const auto offset : sample::record_offsets(file)) {
    const bool copy = (file[offset + 4] & flags::kCopy) != 0;
    if (order_of(sample::type_at(file, offset)) < kSegmentOrder && copy == copies)
      found.push_back(offset);
  }
  return found;
}

Bytes damaged(Bytes file, std::uint64_t at) {
  file[at] ^= 0x10;
  return file;
}

}  // namespace

TEST_CASE("every static record stands twice, the copies behind the last segment") {
  const Bytes file = sample::file();
  const auto originals = statics(file, false), copies = statics(file, true);
  REQUIRE(originals.size() == 10);
  REQUIRE(copies.size() == originals.size());
  CHECK(copies.front() > sample::offset_of(file, types::kSegment, 2));
  CHECK(copies.back() < sample::offset_of(file, types::kIndex));
  for (std::size_t i = 0; i < copies.size(); ++i) {
    CHECK(sample::type_at(file, copies[i]) == sample::type_at(file, originals[i]));
    // Length, checksum and payload are the same; flags and so the header's checksum are not.
    const auto length = static_cast<std::ptrdiff_t>(
        (i + 1 < originals.size() ? originals[i + 1] : sample::offset_of(file, types::kSegment)) -
        originals[i]);
    const auto a = file.begin() + static_cast<std::ptrdiff_t>(originals[i]);
    const auto b = file.begin() + static_cast<std::ptrdiff_t>(copies[i]);
    CHECK(std::equal(a + 8, a + 20, b + 8));
    CHECK(std::equal(a + 24, a + length, b + 24));
  }
}

TEST_CASE("a writer can leave the copies out") {
  MemorySink sink;
  auto writer = Writer::create(sink, "sample 1", {.copies = false}).value();
  sample::add_static(writer);
  REQUIRE(writer.write_segment({7, 0, 5}, sample::chunks(0, 5)));
  REQUIRE(writer.finish());
  const Bytes file = sink.take();
  CHECK(statics(file, true).empty());
  const auto all = read_everything(sample::memory(file));
  REQUIRE(all);
  CHECK(all->errors.empty());
  CHECK(all->finished);
}

TEST_CASE("a damaged static record is taken from its copy") {
  const Bytes file = sample::file();
  const auto whole = read_everything(sample::memory(file)).value();
  const auto offsets = statics(file, false);
  for (std::size_t i = 1; i < offsets.size(); ++i) {
    CAPTURE(i);
    for (const std::uint64_t place : {24u, 20u, 9u}) {  // payload, header checksum, length
      CAPTURE(place);
      const auto repaired = read_everything(sample::memory(damaged(file, offsets[i] + place)));
      REQUIRE(repaired);
      CHECK(sample::same(repaired->contents, whole.contents));
      // With its header a record takes the framing along, and so those that follow.
      CHECK(repaired->contents.repaired == (place == 24 ? 1 : offsets.size() - i));
      CHECK(repaired->rest.size() == whole.rest.size());
      CHECK(repaired->finished);
    }
  }
}

TEST_CASE("what is damaged twice, or cannot be reached, is an error that names the record") {
  const Bytes file = sample::file();
  const auto originals = statics(file, false), copies = statics(file, true);
  for (std::size_t i = 1; i < originals.size(); ++i) {
    CAPTURE(i);
    const Bytes once = damaged(file, originals[i] + 24);
    const std::string name = "'" + type_name(sample::type_at(file, originals[i])) + "' at byte " +
                             std::to_string(originals[i]);
    const auto twice = read_everything(sample::memory(damaged(once, copies[i] + 24)));
    REQUIRE_FALSE(twice);
    CHECK(twice.error().code == ErrorCode::kCorrupt);
    CHECK(twice.error().message.find(name) != std::string::npos);
    const auto forward = read_everything(std::make_unique<sample::Pipe>(once, 4096));
    REQUIRE_FALSE(forward);
    CHECK(forward.error().message.find(name) != std::string::npos);
    // Damage of another copy does no harm.
    const std::size_t other = i == 1 ? 2 : i - 1;
    CHECK(read_everything(sample::memory(damaged(once, copies[other] + 24))));
    // Nor does that of one behind it whose framing is lost; of one before it, it does.
    if (i + 1 < copies.size())
      CHECK(read_everything(sample::memory(damaged(once, copies[i + 1] + 9))));
    CHECK_FALSE(read_everything(sample::memory(damaged(once, copies[i] + 9))));
  }
}

TEST_CASE("damaged copies do not matter where the originals are intact") {
  const Bytes file = sample::file();
  const auto whole = read_everything(sample::memory(file)).value();
  for (const auto offset : statics(file, true)) {
    const auto all = read_everything(sample::memory(damaged(file, offset + 24)));
    REQUIRE(all);
    CHECK(sample::same(all->contents, whole.contents));
    CHECK(all->errors.empty());
  }
}

TEST_CASE("an end record that lies about the copies is found out") {
  Bytes file = sample::file();
  const auto end = sample::offset_of(file, types::kEnd);
  const auto record =
      parse_end(std::span(file).subspan(end + kRecordHeaderBytes, kEndPayloadBytes));
  REQUIRE(record);
  CHECK(record->copies_offset == statics(file, true).front());
  for (const std::uint64_t lie : {std::uint64_t{8}, statics(file, true)[1]}) {
    EndRecord changed = *record;
    changed.copies_offset = lie;
    const auto framed = frame_record(types::kEnd, serialize(changed));
    std::ranges::copy(framed, file.begin() + static_cast<std::ptrdiff_t>(end));
    const auto all = read_everything(sample::memory(file));
    REQUIRE(all);
    REQUIRE(all->errors.size() == 1);
    CHECK(all->errors[0].message.find("copies should be at byte " + std::to_string(lie)) !=
          std::string::npos);
  }
}
