// SPDX-License-Identifier: MIT
#include "player/prefetcher.hpp"

#include <random>

#include "tests/player/coded_file.hpp"
#include "tests/player/prefetch_clip.hpp"

using namespace relit;
using namespace relit::player;
using namespace relit::player::test;

namespace {

Bytes small_clip() { return coded_file({"mpeg4", true, true, true}); }

Bytes damaged_clip() {
  auto bytes = read_bytes(shipped_clip());
  auto reader = container::Reader::open(memory_source(bytes));
  REQUIRE(reader);
  const auto index = reader->read_index();
  REQUIRE(index);
  REQUIRE(index->segments.size() > 3);
  const auto second = index->segments[1], third = index->segments[2];
  for (std::uint64_t at = second.offset + 400; at < third.offset; at += 97) bytes[at] ^= 0x55;
  bytes[index->segments[3].offset + 30] ^= 1;  // the segment's record itself
  return bytes;
}

}  // namespace

TEST_CASE("prefetched frames are those that a ClipReader decodes, for every number of threads") {
  for (const auto& file : {read_bytes(shipped_clip()), small_clip()}) {
    const auto expected = all_frames(file);
    for (const int threads : {1, 2, 4}) {
      for (const int decoder_threads : {0, 2}) {
        auto options = patient();
        options.threads = decoder_threads;
        options.ring_bytes = threads == 1 ? 0 : std::size_t{4} << 20;
        auto prefetcher = prefetch(memory_source(file), options, threads);
        for (std::uint64_t k = 0; k < expected.size(); ++k) {
          INFO(threads << " threads, frame " << k);
          REQUIRE(fetched(*prefetcher, k) == expected[k]);
        }
        CHECK_FALSE(prefetcher->loss().any());
        CHECK(prefetcher->stats().restarts == 0);
      }
    }
  }
}

TEST_CASE("random seeks give the frames that a ClipReader decodes") {
  for (const auto& file : {read_bytes(shipped_clip()), small_clip()}) {
    const auto expected = all_frames(file);
    auto options = patient();
    options.ring_bytes = std::size_t{1} << 20;
    auto prefetcher = prefetch(memory_source(file), options);
    std::mt19937 random(7);
    for (int i = 0; i < 60; ++i) {
      auto k = random() % expected.size();
      const auto run = random() % 4;
      for (std::uint64_t n = 0; n <= run && k < expected.size(); ++n, ++k) {
        INFO("seek " << i << ", frame " << k);
        REQUIRE(fetched(*prefetcher, k) == expected[k]);
      }
      // Some are given up before they come.
      if (i % 3 == 0) prefetcher->want(random() % expected.size());
    }
    CHECK_FALSE(prefetcher->loss().any());
  }
}

TEST_CASE("a prefetched clip loops without a jump of the host's") {
  const auto file = small_clip();
  const auto expected = all_frames(file);
  auto options = patient();
  options.loop = true;
  auto prefetcher = prefetch(memory_source(file), options);
  for (int lap = 0; lap < 5; ++lap) {
    for (std::uint64_t k = 0; k < expected.size(); ++k) {
      REQUIRE(fetched(*prefetcher, k) == expected[k]);
    }
  }
  CHECK(prefetcher->stats().restarts == 0);
  REQUIRE(prefetcher->set_loop(true, 1, 3));
  for (int lap = 0; lap < 3; ++lap) {
    for (std::uint64_t k = 1; k < 3; ++k) REQUIRE(fetched(*prefetcher, k) == expected[k]);
  }
  CHECK(prefetcher->set_loop(true, 2, 2).error().code == ErrorCode::kInvalid);
  CHECK(prefetcher->set_loop(true, 0, kCodedFrames + 1).error().code == ErrorCode::kInvalid);
}

TEST_CASE("damage shows the frames that a ClipReader shows, and is counted as there") {
  const auto file = damaged_clip();
  const auto expected = all_frames(file);
  auto reader = ClipReader::open(memory_source(file), "clip", {});
  REQUIRE(reader);
  ClipFrame frame;
  for (std::uint64_t k = 0; k < expected.size(); ++k) REQUIRE(reader->frame(k, frame));
  auto prefetcher = prefetch(memory_source(file), patient());
  for (std::uint64_t k = 0; k < expected.size(); ++k) {
    INFO(k);
    REQUIRE(fetched(*prefetcher, k) == expected[k]);
  }
  CHECK(reader->loss().frames > 0);
  CHECK(prefetcher->loss().frames == reader->loss().frames);
  CHECK(prefetcher->loss().records == reader->loss().records);
  CHECK(prefetcher->loss().segments == reader->loss().segments);
  CHECK_FALSE(prefetcher->loss().first.empty());
}

TEST_CASE("a truncated file is prefetched as far as it goes and then holds") {
  auto file = read_bytes(shipped_clip());
  file.resize(file.size() * 2 / 3);
  const auto expected = all_frames(file);
  auto prefetcher = prefetch(memory_source(file), patient());
  for (std::uint64_t k = 0; k < expected.size(); ++k) {
    REQUIRE(fetched(*prefetcher, k) == expected[k]);
  }
  CHECK(prefetcher->loss().frames > 0);
}

TEST_CASE("a source that only goes forward is prefetched, and says so when asked to go back") {
  const auto file = read_bytes(shipped_clip());
  const auto expected = all_frames(file);
  auto prefetcher = prefetch(std::make_unique<PipeSource>(file), patient());
  CHECK(fetched(*prefetcher, 0) == expected[0]);
  CHECK(fetched(*prefetcher, 40) == expected[40]);
  prefetcher->want(3);
  const auto back = prefetcher->wait(3, kPatience_s);
  REQUIRE_FALSE(back);
  CHECK(back.error().code == ErrorCode::kNotFound);
  CHECK(back.error().message.find("cannot go back") != std::string::npos);
  for (std::uint64_t k = 41; k < expected.size(); ++k) {
    REQUIRE(fetched(*prefetcher, k) == expected[k]);
  }
}

TEST_CASE("the ring and the packets keep within their bytes") {
  const auto file = read_bytes(shipped_clip());
  auto options = patient();
  options.ring_bytes = 512 * 1024;
  options.packet_bytes = 64 * 1024;
  options.loop = true;
  auto prefetcher = prefetch(memory_source(file), options);
  std::size_t largest = 0;
  for (int i = 0; i < 250; ++i) {
    (void)fetched(*prefetcher, static_cast<std::uint64_t>(i) % prefetcher->clip().frame_count);
    largest = std::max(largest, prefetcher->stats().ring_bytes);
  }
  const auto stats = prefetcher->stats();
  CHECK(largest > 0);
  // One frame more is kept for what is shown.
  const std::size_t frame = stats.ring_bytes_peak / std::max<std::size_t>(stats.ring_frames, 1);
  CHECK(stats.ring_bytes_peak <= options.ring_bytes + 2 * frame);
  CHECK(stats.picture_bytes_peak >= stats.ring_bytes_peak / 2);
  CHECK(stats.decoded_frames >= 250);
  std::uint64_t bytes = 0;
  for (const auto& track : stats.tracks) bytes += track.bytes;
  CHECK(bytes > 0);
}

TEST_CASE("layers that are not wanted are neither fetched nor decoded, and can come back") {
  const auto file = read_bytes(shipped_clip());
  ClipOptions one;
  one.layers = 1;
  const auto first_alone = all_frames(file, one), all = all_frames(file);
  auto options = patient();
  auto prefetcher = prefetch(memory_source(file), options);
  const std::size_t count = prefetcher->layers().size();
  REQUIRE(count > 1);
  CHECK(fetched(*prefetcher, 0) == all[0]);
  std::vector<std::uint8_t> wanted(count, 0);
  wanted[0] = 1;
  REQUIRE(prefetcher->set_layers(wanted, true));
  CHECK(fetched(*prefetcher, 1) == first_alone[1]);
  const auto before = prefetcher->stats();
  for (std::uint64_t k = 2; k < all.size(); ++k) {
    REQUIRE(fetched(*prefetcher, k) == first_alone[k]);
  }
  const auto after = prefetcher->stats();
  for (std::size_t t = 0; t < after.tracks.size(); ++t) {
    if (after.tracks[t].layer > 0) CHECK(after.tracks[t].bytes == before.tracks[t].bytes);
  }
  REQUIRE(prefetcher->set_layers(std::vector<std::uint8_t>(count, 1), true));
  CHECK(fetched(*prefetcher, 30) == all[30]);
  CHECK(prefetcher->set_layers(std::vector<std::uint8_t>(count + 1, 1)).error().code ==
        ErrorCode::kInvalid);
}

TEST_CASE("a stalled source is an underrun: what is shown stays, and playback goes on") {
  const auto file = read_bytes(shipped_clip());
  const auto expected = all_frames(file);
  auto interrupt = std::make_shared<Interrupt>();
  auto gate = std::make_shared<StallingSource::Gate>();
  auto prefetcher =
      prefetch(std::make_unique<StallingSource>(file, file.size() / 2, gate, interrupt), patient(),
               2, interrupt);
  std::uint64_t k = 0;
  for (; k < expected.size(); ++k) {
    prefetcher->want(k);
    const auto came = prefetcher->wait(k, gate->stalls > 0 ? 0.2 : kPatience_s);
    REQUIRE(came);
    if (!*came) break;
    REQUIRE(fingerprint(*prefetcher->frame(k)) == expected[k]);
  }
  REQUIRE(k > 0);
  REQUIRE(k < expected.size());
  CHECK(prefetcher->frame(k) == nullptr);
  CHECK(prefetcher->frame(k) == nullptr);
  CHECK(prefetcher->stats().underruns == 1);
  REQUIRE(prefetcher->shown() != nullptr);
  CHECK(fingerprint(*prefetcher->shown()) == expected[k - 1]);
  gate->open = true;
  for (; k < expected.size(); ++k) REQUIRE(fetched(*prefetcher, k) == expected[k]);
}

TEST_CASE("a seek interrupts a read that blocks") {
  const auto file = read_bytes(shipped_clip());
  const auto expected = all_frames(file);
  auto interrupt = std::make_shared<Interrupt>();
  auto gate = std::make_shared<StallingSource::Gate>();
  auto source = std::make_unique<StallingSource>(file, file.size() / 2, gate, interrupt);
  auto options = patient();
  options.ring_bytes = options.packet_bytes = 0;
  auto prefetcher = prefetch(std::move(source), options, 2, interrupt);
  CHECK(fetched(*prefetcher, 0) == expected[0]);
  // The first jump reads the index, which lies behind the stall.
  gate->open = true;
  CHECK(fetched(*prefetcher, 60) == expected[60]);
  gate->open = false;
  prefetcher->want(expected.size() - 1);
  while (gate->stalls == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  CHECK(fetched(*prefetcher, 2) == expected[2]);
}

TEST_CASE("a prefetcher can be destroyed and cancelled in every state") {
  const auto file = read_bytes(shipped_clip());
  for (int state = 0; state < 8; ++state) {
    auto interrupt = std::make_shared<Interrupt>();
    auto gate = std::make_shared<StallingSource::Gate>();
    gate->open = state < 4;
    // The static part has to be readable; the first segment stalls.
    auto reader = container::Reader::open(memory_source(file));
    const auto first = reader->read_index()->segments.front().offset;
    auto prefetcher = prefetch(std::make_unique<StallingSource>(file, first + 100, gate, interrupt),
                               patient(), 2, interrupt);
    if (state == 1) (void)fetched(*prefetcher, 5);
    if (state == 2) prefetcher->want(70);
    if (state == 3)
      (void)prefetcher->set_layers(std::vector<std::uint8_t>(prefetcher->layers().size(), 0), true);
    if (state == 5) CHECK_FALSE(prefetcher->wait(0, 0.01).value());
    if (state == 6) {
      std::thread other([&] { prefetcher->cancel(); });
      CHECK(prefetcher->wait(0, kPatience_s).error().code == ErrorCode::kCancelled);
      other.join();
    }
    if (state == 7) prefetcher->want(50);
  }
}

TEST_CASE("a thousand prefetchers open and close") {
  const auto file = small_clip();
  auto pool = WorkerPool::create(2);
  REQUIRE(pool);
  for (int i = 0; i < 1000; ++i) {
    auto demuxer = ClipDemuxer::open(memory_source(file), "clip", {});
    REQUIRE(demuxer);
    auto prefetcher = Prefetcher::create(std::move(*demuxer), *pool, {});
    REQUIRE(prefetcher);
    if (i % 4 == 0) (void)fetched(**prefetcher, static_cast<std::uint64_t>(i) % kCodedFrames);
    if (i % 4 == 1) (*prefetcher)->want(3);
  }
}

TEST_CASE("an unevenly spaced clip is found by its ticks") {
  const auto file = small_clip();
  auto reader = ClipReader::open(memory_source(file), "clip", {});
  REQUIRE(reader);
  const auto expected = all_frames(file);
  auto prefetcher = prefetch(memory_source(file), patient());
  for (const std::uint64_t tick : {5u, 0u, 3u, 2u, 4u, 1u}) {
    const auto want = reader->frame_at(tick);
    REQUIRE(want);
    prefetcher->want_tick(tick);
    const auto known = prefetcher->wait_tick(tick, kPatience_s);
    INFO(tick << (known ? "" : known.error().message));
    REQUIRE(known);
    REQUIRE(*known);
    const auto got = prefetcher->span_at_tick(tick);
    REQUIRE(got);
    CHECK(got->frame == *want);
    CHECK(fetched(*prefetcher, got->frame) == expected[got->frame]);
    CHECK(prefetcher->first_tick(got->frame) <= tick);
  }
  prefetcher->want_tick(6);
  const auto beyond = prefetcher->wait_tick(6, kPatience_s);
  REQUIRE_FALSE(beyond);
  CHECK(beyond.error().code == ErrorCode::kNotFound);
}

TEST_CASE("the segment of a tick is come to by going on where it is the next one") {
  const auto file = small_clip();
  const auto expected = all_frames(file);
  for (const bool pipe : {false, true}) {
    std::unique_ptr<container::ByteSource> source = memory_source(file);
    if (pipe) source = std::make_unique<PipeSource>(file);
    auto options = patient();
    options.ring_bytes = options.packet_bytes = 0;
    auto prefetcher = prefetch(std::move(source), options);
    for (const std::uint64_t tick : {0u, 4u}) {
      prefetcher->want_tick(tick);
      REQUIRE(prefetcher->wait_tick(tick, kPatience_s).value());
      const std::uint64_t frame = prefetcher->span_at_tick(tick)->frame;
      CHECK(fetched(*prefetcher, frame) == expected[frame]);
    }
    CHECK(prefetcher->stats().restarts == 0);
  }
}

TEST_CASE("the segment of a tick may be missing, which is an error until playback goes elsewhere") {
  auto file = small_clip();
  auto reader = container::Reader::open(memory_source(file));
  REQUIRE(reader);
  file[reader->read_index()->segments[1].offset + 30] ^= 1;  // the segment's record itself
  auto prefetcher = prefetch(memory_source(file), patient());
  for (int i = 0; i < 3; ++i) {
    prefetcher->want_tick(5);
    const auto missing = prefetcher->wait_tick(5, kPatience_s);
    REQUIRE_FALSE(missing);
    CHECK(missing.error().code == ErrorCode::kNotFound);
    CHECK_FALSE(prefetcher->error());
  }
  CHECK(prefetcher->stats().restarts <= 1);
  (void)fetched(*prefetcher, 1);
  CHECK(prefetcher->error());
}

TEST_CASE("for a frame that damage hit what is shown stays, not what was decoded last") {
  const auto file = damaged_clip();
  const auto expected = all_frames(file);
  auto reader = container::Reader::open(memory_source(file));
  REQUIRE(reader);
  const std::uint64_t hurt = reader->read_index()->segments[1].first_frame;
  REQUIRE(expected[hurt] == expected[hurt - 1]);
  auto options = patient();
  options.ring_bytes = std::size_t{128} << 20;  // more than a segment
  auto prefetcher = prefetch(memory_source(file), options);
  // Before anything is shown there is only what was decoded.
  REQUIRE(prefetcher->wait(hurt - 1, kPatience_s));
  REQUIRE(prefetcher->wait(hurt, kPatience_s));
  const ClipFrame* before = prefetcher->frame(hurt);
  REQUIRE(before != nullptr);
  // Not so that a failure prints megabytes.
  const bool is_last_good = fingerprint(*before) == expected[hurt - 1];
  CHECK(is_last_good);
  for (std::uint64_t k = 0; k < 3; ++k) CHECK(fetched(*prefetcher, k) == expected[k]);
  CHECK(fetched(*prefetcher, hurt + 3) == expected[2]);
  CHECK(prefetcher->loss().frames == 1);
}

TEST_CASE("an impatient prefetcher gives its first picture without all layers, then with them") {
  const auto file = read_bytes(shipped_clip());
  const auto expected = all_frames(file);
  PrefetchOptions options;
  auto prefetcher = prefetch(memory_source(file), options, 1);
  const ClipFrame* frame = nullptr;
  REQUIRE(prefetcher->wait(0, kPatience_s));
  frame = prefetcher->frame(0);
  REQUIRE(frame != nullptr);
  CHECK_FALSE(frame->planes.planes()[0].mantissa.empty());
  for (int i = 0; i < 60000 && !frame->complete; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    frame = prefetcher->frame(0);
  }
  CHECK(fingerprint(*frame) == expected[0]);
}

TEST_CASE("frames beyond the clip and wrong options are refused") {
  const auto file = small_clip();
  auto prefetcher = prefetch(memory_source(file));
  CHECK(prefetcher->wait(kCodedFrames, 1).error().code == ErrorCode::kNotFound);
  auto pool = WorkerPool::create(1);
  PrefetchOptions options;
  options.first_frame = kCodedFrames;
  auto demuxer = ClipDemuxer::open(memory_source(file), "clip", {});
  CHECK(Prefetcher::create(std::move(*demuxer), *pool, options).error().code ==
        ErrorCode::kNotFound);
  options = {};
  options.layers = {1, 1};
  demuxer = ClipDemuxer::open(memory_source(file), "clip", {});
  CHECK(Prefetcher::create(std::move(*demuxer), *pool, options).error().code ==
        ErrorCode::kInvalid);
}

TEST_CASE("a decoder by name that is not there falls back to software and says so") {
  const auto file = read_bytes(shipped_clip());
  const auto expected = all_frames(file);
  for (const char* name : {"h264_v4l2m2m", "no_such_decoder"}) {
    auto options = patient();
    options.decoder = name;
    auto prefetcher = prefetch(memory_source(file), options);
    CHECK(fetched(*prefetcher, 10) == expected[10]);
    const auto notes = prefetcher->stats().notes;
    REQUIRE_FALSE(notes.empty());
    CHECK(notes.front().find(name) != std::string::npos);
  }
}

TEST_CASE("segments that are decoded side by side give the frames that a ClipReader decodes") {
  for (const auto& file : {read_bytes(shipped_clip()), damaged_clip()}) {
    const auto expected = all_frames(file);
    auto options = patient();
    options.ring_bytes = std::size_t{128} << 20;  // more than three segments
    options.loop = true;
    auto prefetcher = prefetch(memory_source(file), options, 3);
    for (const auto& track : prefetcher->stats().tracks)
      CHECK(track.decoders == (track.layer < 0 ? 1 : 3));
    for (int lap = 0; lap < 2; ++lap) {
      for (std::uint64_t k = 0; k < expected.size(); ++k) {
        INFO("lap " << lap << ", frame " << k);
        REQUIRE(fetched(*prefetcher, k) == expected[k]);
      }
    }
    CHECK(prefetcher->stats().restarts == 0);
    // What stands in for a lost frame depends on what was shown before.
    if (prefetcher->loss().any()) continue;
    std::mt19937 random(11);
    for (int i = 0; i < 20; ++i) {
      const auto k = random() % (expected.size() - 1);
      INFO("seek " << i << " to frame " << k);
      REQUIRE(fetched(*prefetcher, k) == expected[k]);
      REQUIRE(fetched(*prefetcher, k + 1) == expected[k + 1]);
    }
  }
}

TEST_CASE("where the ring does not reach over segments a track has one decoder") {
  auto options = patient();
  options.ring_bytes = std::size_t{4} << 20;  // four frames of the shipped clip
  auto prefetcher = prefetch(memory_source(read_bytes(shipped_clip())), options, 3);
  for (const auto& track : prefetcher->stats().tracks) CHECK(track.decoders == 1);
  // Nor where its threads are given, as a memory plan gives them.
  options.ring_bytes = std::size_t{128} << 20;
  options.threads = 1;
  prefetcher = prefetch(memory_source(read_bytes(shipped_clip())), options, 3);
  for (const auto& track : prefetcher->stats().tracks) CHECK(track.decoders == 1);
}

TEST_CASE("until playback moves on from its first picture no more is decoded") {
  auto prefetcher = prefetch(memory_source(read_bytes(shipped_clip())), patient());
  const auto settled = [&] {
    auto before = prefetcher->stats().decoded_frames;
    for (int still = 0; still < 20;) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      const auto now = prefetcher->stats().decoded_frames;
      still = now == before ? still + 1 : 0;
      before = now;
    }
    return before;
  };
  REQUIRE(prefetcher->wait(0, kPatience_s));
  CHECK(settled() <= 2);
  REQUIRE(prefetcher->frame(0) != nullptr);
  CHECK(settled() <= 2);
  prefetcher->want(1);
  // Then the ring fills by itself.
  for (int i = 0; i < 6000 && prefetcher->stats().decoded_frames < 8; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  CHECK(prefetcher->stats().decoded_frames >= 8);
  // A jump is a beginning.
  prefetcher->want(60);
  REQUIRE(prefetcher->wait(60, kPatience_s));
  prefetcher->want(10);
  CHECK(prefetcher->stats().restarts > 0);
  REQUIRE(prefetcher->wait(10, kPatience_s));
  const auto after = prefetcher->stats().decoded_frames;
  CHECK(settled() - after <= 1);
  prefetcher->fetch_ahead();
  for (int i = 0; i < 6000 && prefetcher->stats().decoded_frames < after + 8; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  CHECK(prefetcher->stats().decoded_frames >= after + 8);
}
