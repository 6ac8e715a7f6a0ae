// SPDX-License-Identifier: MIT
// A host's own source, as C callbacks.
#include <algorithm>
#include <utility>
#include <vector>

#include "container/byte_source.hpp"
#include "tests/container/sample.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::container;

namespace {

struct Host {
  sample::Bytes bytes = sample::file();
  std::size_t position = 0;
  int closed = 0;
  std::int64_t answer = 0;  ///< what read() returns instead of reading, unless 0
  int seek_answer = 0;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> expected;
};

Host& host(void* user) { return *static_cast<Host*>(user); }

std::int64_t host_read(void* user, std::uint8_t* out, std::size_t bytes) {
  Host& h = host(user);
  if (h.answer != 0) return h.answer;
  const std::size_t n = std::min({bytes, h.bytes.size() - h.position, std::size_t{100}});
  std::copy_n(h.bytes.begin() + static_cast<std::ptrdiff_t>(h.position), n, out);
  h.position += n;
  return static_cast<std::int64_t>(n);
}

int host_seek(void* user, std::uint64_t offset_bytes) {
  host(user).position = static_cast<std::size_t>(offset_bytes);
  return host(user).seek_answer;
}

std::int64_t host_size(void* user) { return static_cast<std::int64_t>(host(user).bytes.size()); }

void host_expect(void* user, std::uint64_t begin, std::uint64_t end) {
  host(user).expected.emplace_back(begin, end);
}

void host_close(void* user) { ++host(user).closed; }

SourceCallbacks callbacks(Host& h) {
  return {&h, host_read, host_seek, host_size, host_expect, host_close};
}

}  // namespace

TEST_CASE("callbacks serve a whole file, forward and by its index") {
  Host h;
  {
    auto source = CallbackSource::open(callbacks(h));
    REQUIRE(source);
    CHECK((*source)->size() == h.bytes.size());
    CHECK((*source)->seekable());
    auto reader = Reader::open(std::move(*source));
    REQUIRE(reader);
    REQUIRE(load_static(*reader));
    const auto index = reader->read_index();
    REQUIRE(index);
    CHECK(index->segments.size() == 3);
    CHECK_FALSE(h.expected.empty());
    auto record = reader->next();
    while (record && *record) record = reader->next();
    CHECK(record);
    CHECK(reader->finished());
    CHECK(h.closed == 0);
  }
  CHECK(h.closed == 1);
}

TEST_CASE("callbacks other than read may be absent") {
  Host h;
  auto source = CallbackSource::open({&h, host_read, nullptr, nullptr, nullptr, nullptr});
  REQUIRE(source);
  CHECK_FALSE((*source)->seekable());
  CHECK_FALSE((*source)->size());
  CHECK((*source)->seek(8).error().code == ErrorCode::kUnsupported);
  (*source)->expect(0, 100);
  auto reader = Reader::open(std::move(*source));
  REQUIRE(reader);
  CHECK(load_static(*reader));
}

TEST_CASE("callbacks without read are refused, and closed") {
  Host h;
  SourceCallbacks c = callbacks(h);
  c.read = nullptr;
  const auto source = CallbackSource::open(c);
  REQUIRE_FALSE(source);
  CHECK(source.error().code == ErrorCode::kInvalid);
  CHECK(h.closed == 1);
}

TEST_CASE("callbacks' negative values are error codes, and nonsense is an I/O error") {
  Host h;
  auto source = CallbackSource::open(callbacks(h));
  REQUIRE(source);
  std::vector<std::uint8_t> out(10);
  const auto code_of = [&](std::int64_t answer) {
    h.answer = answer;
    const auto got = (*source)->read(out);
    REQUIRE_FALSE(got);
    CHECK(got.error().message.find(std::to_string(answer)) != std::string::npos);
    return got.error().code;
  };
  CHECK(code_of(-1) == ErrorCode::kIo);
  CHECK(code_of(-8) == ErrorCode::kOutOfMemory);
  CHECK(code_of(-10) == ErrorCode::kCancelled);
  CHECK(code_of(-11) == ErrorCode::kIo);
  CHECK(code_of(INT64_MIN) == ErrorCode::kIo);
  CHECK(code_of(11) == ErrorCode::kIo);
  h.seek_answer = -10;
  CHECK((*source)->seek(8).error().code == ErrorCode::kCancelled);
  h.seek_answer = 1;
  CHECK((*source)->seek(8).error().code == ErrorCode::kIo);
}
