// SPDX-License-Identifier: MIT
// Files with gaps, and files without segments.
#include "tests/container/sample.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::container;

namespace {

Writer begin(MemorySink& sink, bool gaps) {
  auto writer = Writer::create(sink, "sample 1", {.copies = true, .gaps = gaps});
  REQUIRE(writer);
  sample::add_static(*writer);
  return std::move(*writer);
}

SegmentInfo segment(std::uint64_t first_frame, std::uint64_t first_tick) {
  return {7, first_frame, 2, {}, first_tick};
}

}  // namespace

TEST_CASE("a writer that allows gaps leaves out frames and tracks, and a reader copes") {
  MemorySink sink;
  Writer writer = begin(sink, true);
  auto chunks = sample::chunks(2, 2);
  chunks.erase(chunks.begin() + 1, chunks.begin() + 3);
  REQUIRE(writer.write_segment(segment(2, 2), chunks));
  REQUIRE(writer.finish());
  const auto all = sample::read_everything(sample::memory(sink.bytes()));
  REQUIRE(all);
  CHECK(all->errors.empty());
  CHECK(all->finished);
  const auto& found = std::get<SegmentRecord>(all->rest.at(0));
  CHECK(found.index == 0);
  CHECK(found.first_frame == 2);
  CHECK(found.first_tick == 2);
  CHECK(found.chunks.size() == 2);
}

TEST_CASE("gaps are refused where nobody allowed them, and nonsense always") {
  MemorySink strict_sink;
  Writer strict = begin(strict_sink, false);
  CHECK_FALSE(strict.write_segment(segment(2, 2), sample::chunks(2, 2)));
  struct Case {
    std::uint64_t first_frame, first_tick;
    const char* says;
  };
  for (const Case& c : {Case{1, 1, "the next one of its clip is 2"}, Case{2, 3, "does not fit"},
                        Case{3, 2, "does not fit"}, Case{4, 4, "beyond the clip"}}) {
    INFO(c.first_frame << " at tick " << c.first_tick);
    MemorySink sink;
    Writer writer = begin(sink, true);
    REQUIRE(writer.write_segment(segment(0, 0), sample::chunks(0, 2)));
    const Status refused = writer.write_segment(segment(c.first_frame, c.first_tick),
                                                sample::chunks(c.first_frame, 2));
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == ErrorCode::kInvalid);
    CHECK(refused.error().message.find(c.says) != std::string::npos);
  }
}

TEST_CASE("a file without segments has its copies too") {
  MemorySink sink;
  auto writer = Writer::create(sink, "sample 1");
  REQUIRE(writer);
  REQUIRE(writer->add(sample::clip()));
  REQUIRE(writer->add(sample::image()));
  REQUIRE(writer->add(sample::material()));
  REQUIRE(writer->finish());
  const auto all = sample::read_everything(sample::memory(sink.bytes()));
  REQUIRE(all);
  CHECK(all->errors.empty());
  CHECK(all->finished);
}

TEST_CASE("a reader hands over the unknown records that it passes over") {
  MemorySink sink;
  Writer writer = begin(sink, true);
  const std::vector<std::uint8_t> payload{1, 2, 3};
  REQUIRE(writer.add_ancillary(record_type("noTe"), payload));
  REQUIRE(writer.write_segment(segment(0, 0), sample::chunks(0, 2)));
  REQUIRE(writer.add_ancillary(record_type("maRk"), payload));
  REQUIRE(writer.finish());
  std::vector<RecordType> types;
  ReaderOptions options;
  options.on_unknown = [&](RecordType type, std::span<const std::uint8_t> bytes) {
    CHECK(std::vector<std::uint8_t>(bytes.begin(), bytes.end()) == payload);
    types.push_back(type);
  };
  const auto all = sample::read_everything(sample::memory(sink.bytes()), options);
  REQUIRE(all);
  CHECK(all->errors.empty());
  CHECK(types == std::vector<RecordType>{record_type("noTe"), record_type("maRk")});
}
