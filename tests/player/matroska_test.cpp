// SPDX-License-Identifier: MIT
// relit export and relit import: what other programs see of the tracks, and what comes back.
#include "player/matroska.hpp"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <cmath>
#include <functional>
#include <map>

#include "decoders/codec_private.hpp"
#include "decoders/ffmpeg.hpp"
#include "player/packet_feed.hpp"
#include "player/video_tracks.hpp"
#include "tests/player/files.hpp"
#include "tests/player/video_clip.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::player;
using namespace relit::player::test;

namespace {

void write_file(const std::string& path, const std::vector<std::uint8_t>& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
}

/// What a player that knows nothing of relit makes of a stream.
struct Seen {
  std::string track, codec;
  std::vector<double> times_s;
};

std::vector<Seen> decode_all(const std::string& path) {
  AVFormatContext* demuxer = nullptr;
  REQUIRE(avformat_open_input(&demuxer, path.c_str(), nullptr, nullptr) == 0);
  REQUIRE(avformat_find_stream_info(demuxer, nullptr) >= 0);
  std::vector<Seen> seen(demuxer->nb_streams);
  std::vector<decoders::ffmpeg::Codec> contexts;
  for (unsigned i = 0; i < demuxer->nb_streams; ++i) {
    const AVStream& stream = *demuxer->streams[i];
    const AVDictionaryEntry* tag = av_dict_get(stream.metadata, "RELIT_TRACK", nullptr, 0);
    REQUIRE(tag != nullptr);
    seen[i].track = tag->value;
    seen[i].codec = avcodec_get_name(stream.codecpar->codec_id);
    const AVCodec* codec = avcodec_find_decoder(stream.codecpar->codec_id);
    contexts.emplace_back(avcodec_alloc_context3(codec));
    REQUIRE(avcodec_parameters_to_context(contexts.back().get(), stream.codecpar) >= 0);
    contexts.back()->thread_count = 1;
    contexts.back()->err_recognition = AV_EF_EXPLODE;
    REQUIRE(avcodec_open2(contexts.back().get(), codec, nullptr) == 0);
  }
  const decoders::ffmpeg::Frame frame(av_frame_alloc());
  const auto receive = [&](std::size_t i) {
    while (avcodec_receive_frame(contexts[i].get(), frame.get()) == 0) {
      seen[i].times_s.push_back(static_cast<double>(frame->best_effort_timestamp) *
                                av_q2d(demuxer->streams[i]->time_base));
    }
  };
  const decoders::ffmpeg::Packet packet(av_packet_alloc());
  while (av_read_frame(demuxer, packet.get()) == 0) {
    const auto i = static_cast<std::size_t>(packet->stream_index);
    REQUIRE(avcodec_send_packet(contexts[i].get(), packet.get()) == 0);
    receive(i);
    av_packet_unref(packet.get());
  }
  for (std::size_t i = 0; i < contexts.size(); ++i) {
    REQUIRE(avcodec_send_packet(contexts[i].get(), nullptr) == 0);
    receive(i);
  }
  avformat_close_input(&demuxer);
  return seen;
}

/// The packets of one track as they go into a Matroska file.
struct Sent {
  MatroskaTrack stream;
  struct Packet {
    std::int64_t time_ns;
    bool key;
    std::vector<std::uint8_t> bytes;
  };
  std::vector<Packet> packets;
};

/// The second layer's track as `relit export` sends it.
Sent mpeg4_track(const VideoClip& made) {
  Sent sent;
  const container::LayerRecord& layer = made.layers[1];
  sent.stream = {3, "mpeg4", "mpeg4", layer.codec_private, layer.coded_width, layer.coded_height};
  ClipTimes times(made.clip);
  for (std::size_t s = 0; s < made.segments.size(); ++s) {
    REQUIRE(times.begin(made.segments[s], 1));
    const container::ChunkRecord& chunk = made.chunks[s][2];
    for (const container::Packet& p : chunk.packets) {
      const auto* bytes = chunk.data.data() + p.offset;
      sent.packets.push_back(
          {times.time_ns(static_cast<std::uint64_t>(p.pts)), p.key, {bytes, bytes + p.size}});
    }
  }
  return sent;
}

void write_matroska(const std::string& path, const Sent& sent) {
  auto writer = MatroskaWriter::create(path, "test", {sent.stream});
  REQUIRE(writer);
  for (std::size_t i = 0; i < sent.packets.size(); ++i) {
    std::int64_t decode = sent.packets[i].time_ns;
    for (std::size_t k = i; k < sent.packets.size(); ++k) {
      decode = std::min(decode, sent.packets[k].time_ns);
    }
    REQUIRE(writer->add(0, sent.packets[i].bytes, sent.packets[i].key,
                        {sent.packets[i].time_ns, decode, 0}));
  }
  REQUIRE(writer->finish());
}

}  // namespace

TEST_CASE("exported tracks come back byte for byte") {
  const Folder folder;
  const VideoClip made = video_clip();
  write_file(folder.file("a.relit"), made.file());
  // B-frames are what makes decoding order interesting.
  CHECK(made.chunks[0][0].packets[1].pts > made.chunks[0][0].packets[2].pts);
  CHECK(made.chunks[0][2].packets[1].pts > made.chunks[0][2].packets[2].pts);
  std::string says;
  const int exported = run_relit(
      "export " + folder.file("a.relit") + " -o " + folder.file("a.mkv") + " --clip waves", &says);
  INFO(says);
  REQUIRE(exported == 0);
  const int imported = run_relit("import " + folder.file("a.relit") + " " + folder.file("a.mkv") +
                                     " -o " + folder.file("b.relit"),
                                 &says);
  INFO(says);
  REQUIRE(imported == 0);
  const Contents a = read_all(folder.file("a.relit")), b = read_all(folder.file("b.relit"));
  CHECK(a.records.clips == b.records.clips);
  CHECK(a.records.models == b.records.models);
  CHECK(a.records.layers == b.records.layers);
  CHECK(a.segments == b.segments);
  REQUIRE(a.chunks.size() == 9);
  CHECK(a.chunks == b.chunks);
  // The same packets give the same Matroska file.
  REQUIRE(run_relit("export " + folder.file("b.relit") + " -o " + folder.file("b.mkv")) == 0);
  CHECK(read_bytes(folder.file("a.mkv")) == read_bytes(folder.file("b.mkv")));
}

TEST_CASE("other programs find every picture at its time") {
  const Folder folder;
  const VideoClip made = video_clip();
  write_file(folder.file("a.relit"), made.file());
  REQUIRE(run_relit("export " + folder.file("a.relit") + " -o " + folder.file("a.mkv")) == 0);
  const std::vector<Seen> seen = decode_all(folder.file("a.mkv"));
  REQUIRE(seen.size() == 3);
  const char* codecs[] = {"h264", "ffv1", "mpeg4"};
  std::vector<double> starts;
  for (const container::SegmentRecord& s : made.segments) {
    std::uint64_t tick = s.first_tick;
    for (std::size_t i = 0; i < s.frame_count; ++i) {
      starts.push_back(static_cast<double>(tick) * 1001 / 30000);
      tick += s.durations.empty() ? 1 : s.durations[i];
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    INFO(codecs[i]);
    CHECK(seen[i].codec == codecs[i]);
    CHECK(seen[i].track == std::to_string(i + 1));
    const std::size_t every = i == 1 ? 4 : 1;
    REQUIRE(seen[i].times_s.size() == 24 / every);
    for (std::size_t k = 0; k < seen[i].times_s.size(); ++k) {
      // Matroska counts milliseconds.
      CHECK(std::abs(seen[i].times_s[k] - starts[k * every]) <= 0.5001e-3);
    }
  }
}

TEST_CASE("headers with start codes are stored as libavformat stores them") {
  const VideoClip made = video_clip();
  const Folder folder;
  // From the record back to start codes; the muxer then makes a record of its own.
  const std::vector<std::uint8_t>& record = made.layers[0].codec_private;
  const std::size_t sps_bytes = record[6] * 256u + record[7];
  const std::size_t pps = 8 + sps_bytes + 3, pps_bytes = record[pps - 2] * 256u + record[pps - 1];
  std::vector<std::uint8_t> annex_b = {0, 0, 0, 1};
  annex_b.insert(annex_b.end(), record.begin() + 8,
                 record.begin() + 8 + static_cast<std::ptrdiff_t>(sps_bytes));
  annex_b.insert(annex_b.end(), {0, 0, 1});
  annex_b.insert(annex_b.end(), record.begin() + static_cast<std::ptrdiff_t>(pps),
                 record.begin() + static_cast<std::ptrdiff_t>(pps + pps_bytes));
  CHECK(*decoders::stored_private("h264", annex_b) == record);
  auto writer =
      MatroskaWriter::create(folder.file("h.mkv"), "", {{1, "", "h264", annex_b, 48, 32}});
  REQUIRE(writer);
  const std::vector<std::uint8_t> slice = {0, 0, 0, 1, 0x65, 0x88, 0x84};
  REQUIRE(writer->add(0, slice, true, {}));
  REQUIRE(writer->finish());
  const auto reader = MatroskaReader::open(folder.file("h.mkv"));
  REQUIRE(reader);
  REQUIRE(reader->tracks().size() == 1);
  CHECK(reader->tracks()[0].codec_private == record);
}

TEST_CASE("import takes some of the tracks and keeps the others") {
  const Folder folder;
  const VideoClip made = video_clip();
  write_file(folder.file("a.relit"), made.file());
  write_matroska(folder.file("one.mkv"), mpeg4_track(made));
  std::string says;
  const int status = run_relit("import " + folder.file("a.relit") + " " + folder.file("one.mkv") +
                                   " -o " + folder.file("b.relit"),
                               &says);
  INFO(says);
  REQUIRE(status == 0);
  CHECK(says.find("1 tracks, 24 packets") != std::string::npos);
  CHECK(read_all(folder.file("a.relit")).chunks == read_all(folder.file("b.relit")).chunks);
}

TEST_CASE("import refuses streams that are not the clip's, and says why") {
  const Folder folder;
  const VideoClip made = video_clip();
  write_file(folder.file("a.relit"), made.file());
  const Sent good = mpeg4_track(made);
  struct Case {
    const char* says;
    std::function<void(Sent&)> change;
  };
  const Case cases[] = {
      {"segment 1 has to begin with a key packet of frame 8",
       [](Sent& s) { s.packets[8].key = false; }},
      {"segment 2 has to begin with a key packet of frame 16",
       [](Sent& s) { s.packets.resize(16); }},
      {"segment 0 has to begin with a key packet of frame 0",
       [](Sent& s) { s.packets.erase(s.packets.begin()); }},
      {"no frame of its segment begins then", [](Sent& s) { s.packets[2].time_ns += 10'000'000; }},
      {"has a packet already", [](Sent& s) { s.packets[2].time_ns = s.packets[1].time_ns; }},
      {"the clip has ended before",
       [](Sent& s) {
         s.packets.push_back({s.packets.back().time_ns + 1'000'000'000, true, {1, 2, 3}});
       }},
      {"no clip has all the video tracks", [](Sent& s) { s.stream.track_id = 9; }},
      {"is coded with ffv1, its layer with mpeg4", [](Sent& s) { s.stream.codec = "ffv1"; }},
      {"pictures of 64x32, its layer has 32x32", [](Sent& s) { s.stream.width = 64; }},
  };
  for (const Case& c : cases) {
    INFO(c.says);
    Sent sent = good;
    c.change(sent);
    write_matroska(folder.file("x.mkv"), sent);
    std::string says;
    CHECK(run_relit("import " + folder.file("a.relit") + " " + folder.file("x.mkv") + " -o " +
                        folder.file("b.relit"),
                    &says) == 1);
    INFO(says);
    CHECK(says.find(c.says) != std::string::npos);
    CHECK_FALSE(std::filesystem::exists(folder.file("b.relit")));
  }
}

TEST_CASE("every truncation of a Matroska file is refused") {
  av_log_set_level(AV_LOG_QUIET);  // demuxers have no level of their own
  const Folder folder;
  const VideoClip made = video_clip();
  write_file(folder.file("a.relit"), made.file());
  write_matroska(folder.file("m.mkv"), mpeg4_track(made));
  const std::vector<std::uint8_t> whole = read_bytes(folder.file("m.mkv"));
  ClipTimes times(made.clip);
  for (std::size_t size = 0; size + 400 < whole.size(); size += 37) {
    INFO(size);
    write_file(folder.file("cut.mkv"),
               {whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)});
    auto reader = MatroskaReader::open(folder.file("cut.mkv"));
    if (!reader || reader->tracks().empty()) continue;
    PacketFeed feed(std::move(*reader), "cut");
    bool lost = false;
    for (std::size_t i = 0; i < made.segments.size() && !lost; ++i) {
      REQUIRE(times.begin(made.segments[i], 1'000'000));
      const auto chunk = feed.chunk(made.segments[i], 0, times);
      lost = !chunk || chunk->packets.size() < 8;
    }
    CHECK(lost);
  }
}

TEST_CASE("export of a damaged file keeps what is whole and says so") {
  const Folder folder;
  const VideoClip made = video_clip();
  std::vector<std::uint8_t> bytes = made.file();
  const auto& data = made.chunks[1][2].data;
  const auto at = std::search(bytes.begin(), bytes.end(), data.begin(), data.end());
  REQUIRE(at != bytes.end());
  *at ^= 1;
  write_file(folder.file("a.relit"), bytes);
  std::string says;
  CHECK(run_relit("export " + folder.file("a.relit") + " -o " + folder.file("a.mkv"), &says) == 3);
  CHECK(says.find("damaged") != std::string::npos);
  const auto reader = MatroskaReader::open(folder.file("a.mkv"));
  REQUIRE(reader);
  auto packets = std::map<std::size_t, int>();
  auto source = std::move(*MatroskaReader::open(folder.file("a.mkv")));
  for (auto packet = source.next(); packet && *packet; packet = source.next()) {
    ++packets[(*packet)->track];
  }
  CHECK(packets[0] == 24);
  CHECK(packets[1] == 6);
  CHECK(packets[2] == 16);
  CHECK(run_relit("import " + folder.file("a.relit") + " " + folder.file("a.mkv") + " -o " +
                  folder.file("b.relit")) == 1);
}

TEST_CASE("frames that Matroska cannot tell apart are refused") {
  const Folder folder;
  write_file(folder.file("a.relit"), video_clip({1200, 1}).file());
  std::string says;
  CHECK(run_relit("export " + folder.file("a.relit") + " -o " + folder.file("a.mkv"), &says) == 1);
  CHECK(says.find("frame 0 is shown for 833333 ns") != std::string::npos);
  CHECK_FALSE(std::filesystem::exists(folder.file("a.mkv")));
  CHECK(
      run_relit("export " + folder.file("a.relit") + " -o " + folder.file("a.mkv") + " --clip run",
                &says) == 2);
  CHECK(says.find("waves") != std::string::npos);
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path), {}) == 1);
}

TEST_CASE("rounded times find their frames") {
  for (const std::int64_t rate : {24LL, 30LL, 120LL, 600LL, 999LL, 1000LL}) {
    container::ClipRecord clip;
    clip.tick_rate = {rate * 1000, 1001};
    if (rate == 1000) clip.tick_rate = {1000, 1};
    clip.frame_count = clip.duration_ticks = 40000;
    ClipTimes times(clip);
    container::SegmentRecord segment;
    segment.first_frame = segment.first_tick = 13;
    segment.frame_count = 30000;
    REQUIRE(times.begin(segment, 1'000'000));
    for (std::uint64_t frame = 13; frame < 30013; ++frame) {
      const std::int64_t rounded = (times.time_ns(frame) + 500'000) / 1'000'000 * 1'000'000;
      if (times.frame_near(rounded, 1'000'000) != frame || times.past(rounded)) {
        FAIL("frame " << frame << " at " << rate);
      }
    }
    CHECK(times.past((times.end_ns() + 500'000) / 1'000'000 * 1'000'000));
    CHECK_FALSE(times.frame_near(times.time_ns(13) - 1'000'001, 1'000'000));
  }
}
