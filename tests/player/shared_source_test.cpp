// SPDX-License-Identifier: MIT
#include "player/shared_source.hpp"

#include <random>

#include "tests/player/coded_file.hpp"
#include "tests/player/prefetch_clip.hpp"

using namespace relit;
using namespace relit::player;
using namespace relit::player::test;

TEST_CASE("cursors of a shared source read at places of their own") {
  Bytes bytes(200'000);
  std::mt19937 random(3);
  for (auto& b : bytes) b = static_cast<std::uint8_t>(random());
  auto shared = SharedSource::create(memory_source(bytes));
  REQUIRE(shared);
  std::vector<std::unique_ptr<container::ByteSource>> cursors;
  std::vector<std::uint64_t> places(3, 0);
  for (int i = 0; i < 3; ++i) cursors.push_back((*shared)->cursor());
  for (int i = 0; i < 3000; ++i) {
    const std::size_t c = random() % 3;
    if (random() % 10 == 0) {
      places[c] = random() % (bytes.size() + 10);
      REQUIRE(cursors[c]->seek(places[c]));
    }
    Bytes out(1 + random() % (random() % 8 == 0 ? 40'000 : 100));
    const auto got = cursors[c]->read(out);
    REQUIRE(got);
    REQUIRE(*got <= out.size());
    if (*got == 0) {
      REQUIRE(places[c] >= bytes.size());
      continue;
    }
    REQUIRE(std::equal(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(*got),
                       bytes.begin() + static_cast<std::ptrdiff_t>(places[c])));
    places[c] += *got;
  }
  CHECK(cursors[0]->size() == bytes.size());
}

TEST_CASE("a source that only goes forward cannot be shared") {
  const auto shared = SharedSource::create(std::make_unique<PipeSource>(Bytes(10)));
  REQUIRE_FALSE(shared);
  CHECK(shared.error().code == ErrorCode::kUnsupported);
}

TEST_CASE("two prefetchers play one file at once, and share what is static") {
  const auto file = read_bytes(shipped_clip());
  const auto expected = all_frames(file);
  auto shared = SharedSource::create(memory_source(file));
  REQUIRE(shared);
  auto first = ClipDemuxer::open((*shared)->cursor(), "clip", {});
  REQUIRE(first);
  auto second = first->another((*shared)->cursor(), {});
  REQUIRE(second);
  CHECK(second->statics() == first->statics());
  auto pool = WorkerPool::create(2);
  PrefetchOptions options = patient();
  auto a = Prefetcher::create(std::move(*first), *pool, options);
  options.first_frame = 30;
  auto b = Prefetcher::create(std::move(*second), *pool, options);
  REQUIRE(a);
  REQUIRE(b);
  for (std::uint64_t k = 0; k + 30 < expected.size(); ++k) {
    REQUIRE(fetched(**a, k) == expected[k]);
    REQUIRE(fetched(**b, k + 30) == expected[k + 30]);
  }
  auto other = ClipDemuxer::open(memory_source(coded_file()), "other", {});
  REQUIRE(other);
  CHECK_FALSE(other->another((*shared)->cursor(), {}));
}
