// SPDX-License-Identifier: MIT
// The HTTP source against a server that can be told to fail.
#include "player/http_source.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "container/reader.hpp"
#include "player/clip_reader.hpp"
#include "tests/player/files.hpp"
#include "tests/player/http_server.hpp"
#include "tests/test.hpp"

extern "C" {
#include <libavutil/log.h>
}

using namespace relit;
using namespace relit::player;
using namespace relit::player::test;

namespace {

using Bytes = std::vector<std::uint8_t>;

// Long enough for a busy machine, short enough to be waited for.
SourceOptions hasty() {
  av_log_set_level(AV_LOG_QUIET);  // what libavformat prints of faults that are meant to happen
  SourceOptions options;
  options.connect_timeout_s = 10, options.read_timeout_s = 10, options.retry_s = 5;
  return options;
}

SourceOptions impatient() {
  SourceOptions options = hasty();
  options.connect_timeout_s = 0.5, options.read_timeout_s = 0.5, options.retry_s = 0;
  return options;
}

std::unique_ptr<HttpSource> open_http(const std::string& address, const SourceOptions& options) {
  auto source = HttpSource::open(address, options);
  INFO((source ? "" : source.error().message));
  REQUIRE(source);
  return std::move(*source);
}

Error refusal(const std::string& address, const SourceOptions& options) {
  auto source = HttpSource::open(address, options);
  REQUIRE_FALSE(source);
  return source.error();
}

// All that comes, and the error that ends it, if one does.
struct Got {
  Bytes bytes;
  std::optional<Error> error;
};

Got read_all(HttpSource& source) {
  Got got;
  Bytes buffer(50'000);
  for (;;) {
    const auto n = source.read(buffer);
    if (!n) got.error = n.error();
    if (!n || *n == 0) return got;
    got.bytes.insert(got.bytes.end(), buffer.begin(),
                     buffer.begin() + static_cast<std::ptrdiff_t>(*n));
  }
}

bool is_prefix(const Bytes& part, const Bytes& whole) {
  return part.size() <= whole.size() && std::equal(part.begin(), part.end(), whole.begin());
}

bool contains(const Error& error, const std::string& text) {
  return error.message.find(text) != std::string::npos;
}

// Where a clip's bytes lie.
struct Layout {
  std::uint64_t static_bytes = 0;
  std::uint64_t wanted_bytes = 0;  ///< segment records, poses and the first layers
};

Layout layout_of(const Bytes& file, std::size_t layer_count) {
  auto reader = container::Reader::open(std::make_unique<container::MemorySource>(file));
  REQUIRE(reader);
  const auto contents = container::load_static(*reader);
  REQUIRE(contents);
  std::vector<std::uint32_t> tracks{contents->pose_tracks.front().track_id};
  const auto layers = contents->layers_of(contents->models.front().id);
  for (std::size_t i = 0; i < std::min(layer_count, layers.size()); ++i) {
    tracks.push_back(layers[i].mantissa_track);
    if (layers[i].has_exponents) tracks.push_back(layers[i].exponent_track);
  }
  Layout layout{reader->offset_bytes(), 0};
  for (;;) {
    const auto record = reader->next();
    REQUIRE(record);
    if (!*record) return layout;
    const auto* segment = std::get_if<container::SegmentRecord>(&(*record)->body);
    if (segment == nullptr) continue;
    layout.wanted_bytes += reader->offset_bytes() - (*record)->offset_bytes;
    for (const auto& chunk : segment->chunks) {
      if (std::ranges::find(tracks, chunk.track_id) != tracks.end())
        layout.wanted_bytes += chunk.chunk_bytes;
    }
  }
}

// A clip and the source under it, which the clip owns.
struct Opened {
  HttpSource* source;
  ClipReader clip;
};

Opened open_clip(const std::string& address, const ClipOptions& options,
                 SourceOptions source_options = hasty()) {
  source_options.sparing = options.spares_bytes();
  auto source = open_http(address, source_options);
  HttpSource* const bare = source.get();
  auto clip = ClipReader::open(std::move(source), "clip", options);
  INFO((clip ? "" : clip.error().message));
  REQUIRE(clip);
  return {bare, std::move(*clip)};
}

void play_to_end(ClipReader& clip) {
  ClipFrame frame;
  for (std::uint64_t k = 0; k < clip.clip().frame_count; ++k) {
    const Status status = clip.frame(k, frame);
    INFO(k << (status ? "" : ": " + status.error().message));
    REQUIRE(status);
  }
  CHECK_FALSE(clip.loss().any());
}

std::uint64_t total_sent(const std::vector<HttpServer::Request>& requests) {
  std::uint64_t bytes = 0;
  for (const auto& request : requests) bytes += request.sent;
  return bytes;
}

}  // namespace

TEST_CASE("http: playing everything sends one request") {
  const Bytes file = read_bytes(shipped_clip());
  const HttpServer server(shipped_clip());
  {
    const auto source = open_http(server.address("ok/read"), hasty());
    CHECK(source->size() == file.size());
    CHECK(source->seekable());
    const Got got = read_all(*source);
    CHECK_FALSE(got.error);
    CHECK(got.bytes == file);
    CHECK(source->traffic().requests == 1);
    CHECK(source->traffic().bytes == file.size());
  }
  auto opened = open_clip(server.address("ok/play"), {});
  play_to_end(opened.clip);
  CHECK(opened.source->traffic().requests == 1);
}

TEST_CASE("http: layers that are left out are not fetched") {
  const Bytes file = read_bytes(shipped_clip());
  const HttpServer server(shipped_clip());
  for (const int layers : {0, 1, 2}) {
    INFO(layers << " layers");
    const auto layout = layout_of(file, static_cast<std::size_t>(layers));
    const std::size_t before = server.log(0).size();
    HttpSource::Traffic traffic;
    {
      ClipOptions options;
      options.layers = layers;
      auto opened = open_clip(server.address("ok/layers"), options);
      play_to_end(opened.clip);
      traffic = opened.source->traffic();
    }
    auto requests = server.log(before + traffic.requests);
    requests.erase(requests.begin(), requests.begin() + static_cast<std::ptrdiff_t>(before));
    CHECK(requests.size() == traffic.requests);
    const std::uint64_t needed = layout.static_bytes + layout.wanted_bytes;
    const std::uint64_t sent = total_sent(requests);
    std::printf("layers %d: needed %llu bytes, sent %llu (%.4f) in %llu requests\n", layers,
                static_cast<unsigned long long>(needed), static_cast<unsigned long long>(sent),
                static_cast<double>(sent) / static_cast<double>(needed),
                static_cast<unsigned long long>(traffic.requests));
    // The end of a range whose length was guessed too long may be under way when it is closed.
    CHECK(sent >= traffic.bytes);
    CHECK(sent <= needed + needed / 20);
    for (const auto& request : requests) CHECK(request.range.back() != '-');
  }
}

TEST_CASE("http: the first picture needs the static part and 64 KiB") {
  const Bytes file = read_bytes(shipped_clip());
  const auto limit = layout_of(file, 0).static_bytes + 65536;
  const HttpServer server(shipped_clip());
  ClipFrame frame;
  ClipOptions all;
  all.impatient = true;
  auto whole = open_clip(server.address("ok/all"), all);
  REQUIRE(whole.clip.frame(0, frame));
  CHECK(whole.source->traffic().bytes <= limit);
  const auto& planes = frame.planes.planes();
  CHECK_FALSE(planes.front().mantissa.empty());
  CHECK(planes.back().mantissa.empty());
  // From the second frame on nothing is left out.
  REQUIRE(whole.clip.frame(1, frame));
  CHECK_FALSE(frame.planes.planes().back().mantissa.empty());
  CHECK_FALSE(whole.clip.loss().any());

  ClipOptions first;
  first.layers = 1;
  auto sparing = open_clip(server.address("ok/first"), first);
  REQUIRE(sparing.clip.frame(0, frame));
  CHECK(sparing.source->traffic().bytes <= limit);
}

TEST_CASE("http: seeking fetches what is sought") {
  const HttpServer server(shipped_clip());
  ClipOptions options;
  options.sparing = true;
  auto opened = open_clip(server.address("ok/seek"), options);
  auto local = container::FileSource::open(shipped_clip().string());
  REQUIRE(local);
  auto expected = ClipReader::open(std::move(*local), "clip", {});
  REQUIRE(expected);
  ClipFrame frame, reference;
  for (const std::uint64_t k : {90u, 3u, 60u, 61u}) {
    INFO(k);
    REQUIRE(opened.clip.frame(k, frame));
    REQUIRE(expected->frame(k, reference));
    const auto a = frame.planes.planes(), b = reference.planes.planes();
    REQUIRE(a.size() == b.size());
    for (std::size_t p = 0; p < a.size(); ++p)
      CHECK(decoders::plane_value(a[p], 5, 9) == decoders::plane_value(b[p], 5, 9));
  }
}

TEST_CASE("http: a server without ranges is played forward, with a warning") {
  const HttpServer server(shipped_clip());
  for (const int layers : {-1, 1}) {
    std::vector<std::string> warnings;
    SourceOptions source_options = hasty();
    source_options.warn = [&](const std::string& sentence) { warnings.push_back(sentence); };
    ClipOptions options;
    options.layers = layers;
    auto opened = open_clip(server.address("plain"), options, source_options);
    play_to_end(opened.clip);
    REQUIRE(warnings.size() == 1);
    CHECK(warnings.front().find("does not answer Range requests") != std::string::npos);
    CHECK_FALSE(opened.source->seekable());
    ClipFrame frame;
    const Status back = opened.clip.frame(0, frame);
    REQUIRE_FALSE(back);
    CHECK(back.error().message.find("cannot go back") != std::string::npos);
  }
}

TEST_CASE("http: refusals say why") {
  const HttpServer server(shipped_clip());
  struct Case {
    const char* fault;
    const char* says;
  };
  for (const Case& c :
       {Case{"status/404", "404"}, Case{"status/403", "403"}, Case{"status/410", "4XX"},
        Case{"status/500", "5XX"}, Case{"status/503", "5XX"}, Case{"redirect", "redirects"},
        Case{"mute", "nothing came for 0.5 s"}, Case{"hangup", "cannot be opened"}}) {
    INFO(c.fault);
    const Error error = refusal(server.address(c.fault), impatient());
    INFO(error.message);
    CHECK(error.code == ErrorCode::kIo);
    CHECK(contains(error, c.says));
    CHECK(contains(error, server.address(c.fault)));
  }
  // Nobody listens on the port of "discard".
  CHECK(refusal("http://127.0.0.1:9/x.relit", impatient()).code == ErrorCode::kIo);
}

TEST_CASE("http: a connection cut anywhere is taken up where it broke") {
  const Bytes file = read_bytes(shipped_clip());
  const HttpServer server(shipped_clip());
  for (std::size_t tenth = 0; tenth < 10; ++tenth) {
    const std::string at = std::to_string(tenth * file.size() / 10);
    INFO(at);
    const auto source = open_http(server.address("cut/" + at), hasty());
    const Got got = read_all(*source);
    INFO((got.error ? got.error->message : ""));
    CHECK_FALSE(got.error);
    CHECK(got.bytes == file);
    CHECK(source->traffic().requests == 2);
    CHECK(source->traffic().bytes == file.size());
  }
}

TEST_CASE("http: a connection that ends for good gives what came and an error") {
  const Bytes file = read_bytes(shipped_clip());
  const HttpServer server(shipped_clip());
  for (std::size_t tenth = 0; tenth < 10; ++tenth) {
    const std::string at = std::to_string(tenth * file.size() / 10);
    for (const char* fault : {"end/", "plaincut/", "stall/"}) {
      INFO(fault << at);
      const auto source = open_http(server.address(fault + at), impatient());
      const Got got = read_all(*source);
      CHECK(got.bytes.size() == std::stoul(at));
      CHECK(is_prefix(got.bytes, file));
      REQUIRE(got.error);
      INFO(got.error->message);
      CHECK(got.error->code == ErrorCode::kIo);
      CHECK(contains(*got.error, "lost at byte " + at));
    }
  }
  // Frames whose segments came are playable.
  auto opened =
      open_clip(server.address("end/" + std::to_string(file.size() / 2)), {}, impatient());
  ClipFrame frame;
  CHECK(opened.clip.frame(0, frame));
  const Status last = opened.clip.frame(opened.clip.clip().frame_count - 1, frame);
  REQUIRE_FALSE(last);
  CHECK(last.error().code == ErrorCode::kIo);
}

TEST_CASE("http: lengths that are wrong end in an error") {
  const Bytes file = read_bytes(shipped_clip());
  const HttpServer server(shipped_clip());
  const auto longer = open_http(server.address("long/1000"), impatient());
  const Got got = read_all(*longer);
  CHECK(got.bytes == file);
  REQUIRE(got.error);
  CHECK(contains(*got.error, "of " + std::to_string(file.size() + 1000)));

  // The source cannot know better, but the file does.
  auto shorter = container::Reader::open(open_http(server.address("short/1000"), impatient()));
  REQUIRE(shorter);
  Result<std::optional<container::Record>> record = shorter->next();
  while (record && *record) record = shorter->next();
  CHECK_FALSE(shorter->finished());
  REQUIRE_FALSE(record);
  CHECK(record.error().code == ErrorCode::kTruncated);
}

TEST_CASE("http: a file that changes while it is read is an error") {
  const Bytes file = read_bytes(shipped_clip());
  const HttpServer server(shipped_clip());
  Bytes some(10);
  const auto grown = open_http(server.address("grows"), hasty());
  REQUIRE(grown->read(some));
  REQUIRE(grown->seek(file.size() - 100));
  const auto got = grown->read(some);
  REQUIRE_FALSE(got);
  CHECK(got.error().code == ErrorCode::kIo);
  CHECK(contains(got.error(), "changed while it was read"));
  CHECK(contains(got.error(), std::to_string(file.size() + 8)));

  // Of the same length, only the records' checksums can tell.
  ClipOptions options;
  options.layers = 1;
  SourceOptions source_options = hasty();
  source_options.sparing = true;
  auto swapped =
      ClipReader::open(open_http(server.address("swaps"), source_options), "clip", options);
  CHECK_FALSE(swapped);
}

TEST_CASE("http: a slow server is waited for") {
  const Bytes file = read_bytes(shipped_clip());
  const HttpServer server(shipped_clip());
  const auto source = open_http(server.address("slow/2000000"), hasty());
  const Got got = read_all(*source);
  CHECK_FALSE(got.error);
  CHECK(got.bytes == file);
}

TEST_CASE("http: waiting can be interrupted") {
  const HttpServer server(shipped_clip());
  SourceOptions options = hasty();
  // So long that only the interruption can end the test.
  options.connect_timeout_s = options.read_timeout_s = options.retry_s = 1e6;
  int polls = 0;
  options.interrupt = [&] { return ++polls > 3; };
  CHECK(refusal(server.address("mute"), options).code == ErrorCode::kCancelled);

  // A stall, and the pauses between attempts at what no longer answers.
  for (const char* fault : {"stall/5000", "end/5000"}) {
    INFO(fault);
    bool stop = false;
    options.interrupt = [&] { return stop && ++polls > 3; };
    const auto source = open_http(server.address(fault), options);
    Bytes some(5000);
    std::size_t done = 0;
    while (done < some.size()) {
      const auto n = source->read(std::span(some).subspan(done));
      REQUIRE(n);
      done += *n;
    }
    polls = 0, stop = true;
    const auto got = source->read(some);
    REQUIRE_FALSE(got);
    CHECK(got.error().code == ErrorCode::kCancelled);
  }
}

TEST_CASE("http: headers are sent with every request, and only headers") {
  const HttpServer server(shipped_clip());
  SourceOptions options = hasty();
  CHECK(contains(refusal(server.address("header"), options), "403"));
  options.http_headers = {"Accept-Language: de", "X-Relit-Test: yes"};
  const auto source = open_http(server.address("header"), options);
  REQUIRE(source->seek(1000));
  Bytes some(10);
  CHECK(source->read(some));
  for (const char* header :
       {"no colon", ": no name", "two words: x", "X: a\r\nY: b", "range: bytes=0-"}) {
    INFO(header);
    options.http_headers = {header};
    CHECK(refusal(server.address("ok"), options).code == ErrorCode::kInvalid);
  }
}

TEST_CASE("http: commands take headers and warn") {
  const HttpServer server(shipped_clip());
  std::string says;
  CHECK(run_relit("info " + server.address("header"), &says) == 1);
  CHECK(says.find("403") != std::string::npos);
  CHECK(run_relit("info --http-header 'X-Relit-Test: yes' " + server.address("header"), &says) ==
        0);
  CHECK(run_relit("info " + server.address("plain"), &says) == 0);
  CHECK(says.find("warning") != std::string::npos);
  CHECK(run_relit("info --http-header nonsense " + server.address("ok"), &says) == 2);
}

// Run by tests/player/nginx_stream.sh, which sets the address.
TEST_CASE("nginx: traffic of a stream", "[.nginx]") {
  const char* address = std::getenv("RELIT_STREAM");
  REQUIRE(address != nullptr);
  const auto static_bytes = layout_of(read_bytes(shipped_clip()), 0).static_bytes;
  ClipFrame frame;
  ClipOptions all;
  all.impatient = true;
  {
    auto opened = open_clip(address, all);
    REQUIRE(opened.clip.frame(0, frame));
    const auto traffic = opened.source->traffic();
    std::printf("first picture, all layers: %llu bytes fetched, static part %llu + %lld\n",
                static_cast<unsigned long long>(traffic.bytes),
                static_cast<unsigned long long>(static_bytes),
                static_cast<long long>(traffic.bytes) - static_cast<long long>(static_bytes));
    CHECK(traffic.bytes <= static_bytes + 65536);
  }
  for (const int layers : {1, 2}) {
    ClipOptions options;
    options.layers = layers;
    auto opened = open_clip(std::string(address) + "?layers=" + std::to_string(layers), options);
    REQUIRE(opened.clip.frame(0, frame));
    const auto first = opened.source->traffic();
    play_to_end(opened.clip);
    const auto layout = layout_of(read_bytes(shipped_clip()), static_cast<std::size_t>(layers));
    std::printf(
        "layers %d: first picture after static part + %lld bytes; in all %llu bytes fetched in "
        "%llu requests, needed %llu\n",
        layers, static_cast<long long>(first.bytes) - static_cast<long long>(static_bytes),
        static_cast<unsigned long long>(opened.source->traffic().bytes),
        static_cast<unsigned long long>(opened.source->traffic().requests),
        static_cast<unsigned long long>(layout.static_bytes + layout.wanted_bytes));
  }
}
