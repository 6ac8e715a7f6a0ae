// SPDX-License-Identifier: MIT
#include "container/record_scan.hpp"

#include "container/record_codec.hpp"
#include "tests/container/sample.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::container;
using sample::Bytes;

namespace {

struct Scanned {
  std::vector<FoundRecord> records;
  std::uint64_t damaged_bytes = 0;
};

Scanned scan(const Bytes& file) {
  MemorySource source{std::span<const std::uint8_t>(file)};
  auto scan = RecordScan::create(source);
  REQUIRE(scan);
  Scanned all;
  for (;;) {
    const auto record = scan->next();
    REQUIRE(record);
    if (!*record) break;
    all.records.push_back(**record);
  }
  all.damaged_bytes = scan->damaged_bytes();
  return all;
}

}  // namespace

TEST_CASE("a scan finds every record of an intact file") {
  const Bytes file = sample::file();
  const Scanned all = scan(file);
  std::vector<std::uint64_t> offsets;
  for (const FoundRecord& r : all.records) {
    CHECK(r.intact);
    offsets.push_back(r.offset_bytes);
  }
  CHECK(offsets == sample::record_offsets(file));
  CHECK(all.damaged_bytes == 0);
}

TEST_CASE("a damaged byte costs a scan the record that it is in") {
  const Bytes file = sample::file();
  const auto offsets = sample::record_offsets(file);
  for (std::size_t at = kSignature.size(); at < file.size(); ++at) {
    INFO("byte " << at);
    Bytes damaged = file;
    damaged[at] ^= 0x10;
    std::size_t intact = 0;
    for (const FoundRecord& r : scan(damaged).records) intact += r.intact;
    // Padding carries nothing.
    CHECK(intact >= offsets.size() - 1);
    CHECK(intact <= offsets.size());
  }
}

TEST_CASE("a scan finds records at odd places and behind lost bytes") {
  const Bytes file = sample::file();
  const auto segment = sample::offset_of(file, types::kSegment);
  for (std::size_t lost = 1; lost < 20; ++lost) {
    INFO(lost << " bytes");
    Bytes shorter = file;
    const auto at = shorter.begin() + static_cast<std::ptrdiff_t>(segment + 30);
    shorter.erase(at, at + static_cast<std::ptrdiff_t>(lost));
    std::size_t intact = 0;
    for (const FoundRecord& r : scan(shorter).records) intact += r.intact;
    CHECK(intact == sample::record_offsets(file).size() - 1);
  }
}

TEST_CASE("a scan gives payloads again, and notices a source that cannot seek") {
  const Bytes file = sample::file();
  MemorySource source{std::span<const std::uint8_t>(file)};
  auto scan = RecordScan::create(source);
  REQUIRE(scan);
  const auto head = scan->next();
  REQUIRE(head);
  const Bytes first(scan->payload().begin(), scan->payload().end());
  REQUIRE(scan->next());
  REQUIRE(scan->read_again(**head));
  CHECK(Bytes(scan->payload().begin(), scan->payload().end()) == first);
  const auto third = scan->next();
  REQUIRE(third);
  CHECK((**third).offset_bytes == sample::record_offsets(file)[2]);
  sample::Pipe pipe(file);
  const auto refused = RecordScan::create(pipe);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == ErrorCode::kUnsupported);
}

TEST_CASE("records inside damaged records inside records cost a scan no more than a few passes") {
  Bytes nested(kSignature.begin(), kSignature.end());
  constexpr std::size_t kRecords = 5'000;
  for (std::size_t i = 0; i < kRecords; ++i) {
    const auto header = encode_header({types::kImage, 0, 1u << 20, 1});
    nested.insert(nested.end(), header.begin(), header.end());
  }
  // Once the passes are spent, the first record is believed to reach to the end.
  CHECK(scan(nested).records.size() < 50);
}
