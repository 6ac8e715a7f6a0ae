// SPDX-License-Identifier: MIT
#include "tests/player/video_clip.hpp"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/opt.h>
}

#include <algorithm>
#include <memory>

#include "container/byte_sink.hpp"
#include "container/writer.hpp"
#include "decoders/codec_private.hpp"
#include "decoders/ffmpeg.hpp"
#include "tests/player/files.hpp"
#include "tests/test.hpp"

namespace relit::player::test {
namespace {

constexpr int kFrames = 24, kSegment = 8;

struct Stream {
  const char* encoder;
  const char* codec;
  AVPixelFormat pixels;
  int width, height;
  int every;  // frames a picture
};

void paint(AVFrame& frame, int seed) {
  for (int plane = 0; plane < 3 && frame.data[plane] != nullptr; ++plane) {
    const int shift = plane > 0 ? 1 : 0;
    for (int y = 0; y < frame.height >> shift; ++y) {
      for (int x = 0; x < frame.width >> shift; ++x) {
        frame.data[plane][y * frame.linesize[plane] + x] =
            static_cast<std::uint8_t>(128 + ((x * 5 + y * 3 + seed * 4) % 64) - 32);
      }
    }
  }
}

decoders::ffmpeg::Codec open_encoder(const Stream& stream) {
  const AVCodec* codec = avcodec_find_encoder_by_name(stream.encoder);
  REQUIRE(codec != nullptr);
  decoders::ffmpeg::Codec context(avcodec_alloc_context3(codec));
  context->width = stream.width;
  context->height = stream.height;
  context->pix_fmt = stream.pixels;
  context->time_base = {1, 25};
  context->thread_count = 1;
  context->gop_size = kSegment / stream.every;
  context->level = std::string(stream.codec) == "ffv1" ? 3 : context->level;
  if (std::string(stream.codec) != "ffv1") context->max_b_frames = 2;
  context->flags |= AV_CODEC_FLAG_GLOBAL_HEADER | AV_CODEC_FLAG_CLOSED_GOP | AV_CODEC_FLAG_BITEXACT;
  context->log_level_offset = decoders::ffmpeg::kQuiet;
  // MPEG-4 closes its groups of pictures only when it need not look for cuts.
  av_opt_set(context->priv_data, "sc_threshold", "1000000000", 0);
  av_opt_set(context->priv_data, "slicecrc", "1", 0);
  av_opt_set(context->priv_data, "forced-idr", "1", 0);
  av_opt_set(context->priv_data, "x264-params", "scenecut=0:open-gop=0:b-adapt=0:log=-1", 0);
  REQUIRE(avcodec_open2(context.get(), codec, nullptr) == 0);
  return context;
}

/// Encodes the clip's pictures; returns codec_private and fills a chunk for each segment.
std::vector<std::uint8_t> encode(const Stream& stream, std::uint32_t track,
                                 std::vector<std::vector<container::ChunkRecord>>& segments) {
  const decoders::ffmpeg::Codec context = open_encoder(stream);
  const decoders::ffmpeg::Packet packet(av_packet_alloc());
  for (auto& chunks : segments) {
    chunks.emplace_back();
    chunks.back().track_id = track;
  }
  const auto receive = [&] {
    while (avcodec_receive_packet(context.get(), packet.get()) == 0) {
      const auto bytes = decoders::stored_packet(
          stream.codec, {packet->data, static_cast<std::size_t>(packet->size)});
      REQUIRE(bytes);
      auto& chunk = segments[static_cast<std::size_t>(packet->pts / kSegment)].back();
      chunk.packets.push_back(
          {packet->pts, (packet->flags & AV_PKT_FLAG_KEY) != 0, chunk.data.size(), bytes->size()});
      chunk.data.insert(chunk.data.end(), bytes->begin(), bytes->end());
      av_packet_unref(packet.get());
    }
  };
  for (int i = 0; i < kFrames; i += stream.every) {
    const decoders::ffmpeg::Frame frame(av_frame_alloc());
    frame->format = stream.pixels;
    frame->width = stream.width;
    frame->height = stream.height;
    REQUIRE(av_frame_get_buffer(frame.get(), 0) == 0);
    paint(*frame, i);
    frame->pts = i;
    frame->pict_type = i % kSegment == 0 ? AV_PICTURE_TYPE_I : AV_PICTURE_TYPE_NONE;
    REQUIRE(avcodec_send_frame(context.get(), frame.get()) == 0);
    receive();
  }
  REQUIRE(avcodec_send_frame(context.get(), nullptr) == 0);
  receive();
  auto stored = decoders::stored_private(
      stream.codec, {context->extradata, static_cast<std::size_t>(context->extradata_size)});
  REQUIRE(stored);
  return std::move(*stored);
}

container::LayerRecord layer(std::uint32_t id, std::uint32_t track, const Stream& stream) {
  container::LayerRecord record;
  record.id = id;
  record.mantissa_track = track;
  record.codec = stream.codec;
  record.coded_width = static_cast<std::uint16_t>(stream.width);
  record.coded_height = static_cast<std::uint16_t>(stream.height);
  container::PlaneRecord plane;
  plane.mantissa_rect = {0, 0, 16, 16};
  plane.exponent_rect = {0, 0, 16, 16};
  plane.matrix = {{0, 0, 1.0f}};
  record.planes.push_back(plane);
  return record;
}

}  // namespace

VideoClip video_clip(container::Rational tick_rate) {
  const Stream h264{"libx264", "h264", AV_PIX_FMT_YUV420P, 48, 32, 1};
  const Stream ffv1{"ffv1", "ffv1", AV_PIX_FMT_GRAY8, 16, 16, 4};
  const Stream mpeg4{"mpeg4", "mpeg4", AV_PIX_FMT_YUV420P, 32, 32, 1};
  VideoClip made;
  made.chunks.resize(kFrames / kSegment);
  made.clip.name = "waves";
  made.clip.tick_rate = tick_rate;
  made.clip.frame_count = kFrames;
  made.clip.bounds_max = {1, 1, 1};
  made.model.order = 0;
  made.model.width = made.model.height = 16;
  made.model.mean = {{0, 0, 0}};
  made.layers = {layer(0, 1, h264), layer(1, 3, mpeg4)};
  container::LayerRecord& first = made.layers[0];
  first.codec_private = encode(h264, 1, made.chunks);
  first.mantissa_pictures = *decoders::decoder_pictures("h264", first.codec_private);
  first.has_exponents = true;
  first.exponent_track = 2;
  first.exponent_codec = "ffv1";
  first.exponent_width = first.exponent_height = 16;
  first.exponent_private = encode(ffv1, 2, made.chunks);
  made.layers[1].codec_private = encode(mpeg4, 3, made.chunks);
  made.layers[1].mantissa_pictures = 3;
  for (std::uint32_t i = 0; i < made.chunks.size(); ++i) {
    container::SegmentRecord segment;
    segment.index = i;
    segment.first_frame = std::uint64_t{i} * kSegment;
    segment.frame_count = kSegment;
    segment.first_tick = made.clip.duration_ticks;
    if (i == 1) segment.durations = {1, 2, 1, 50, 1, 1, 3, 7};
    made.clip.duration_ticks += container::duration_ticks(segment);
    made.segments.push_back(std::move(segment));
  }
  return made;
}

std::vector<std::uint8_t> VideoClip::file() const {
  container::MemorySink sink;
  auto writer = container::Writer::create(sink, "test");
  REQUIRE(writer);
  REQUIRE(writer->add(clip));
  REQUIRE(writer->add(model));
  for (const auto& record : layers) REQUIRE(writer->add(record));
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const container::SegmentRecord& s = segments[i];
    const Status written =
        writer->write_segment({s.clip_id, s.first_frame, s.frame_count, s.durations}, chunks[i]);
    INFO((written ? "" : written.error().message));
    REQUIRE(written);
  }
  REQUIRE(writer->finish());
  return sink.take();
}

Contents read_all(const std::string& path) {
  auto reader =
      container::Reader::open(std::make_unique<container::MemorySource>(read_bytes(path)));
  REQUIRE(reader);
  auto records = container::load_static(*reader);
  REQUIRE(records);
  Contents contents;
  contents.records = std::move(*records);
  for (;;) {
    auto record = reader->next();
    REQUIRE(record);
    if (!*record) break;
    if (auto* s = std::get_if<container::SegmentRecord>(&(*record)->body)) {
      contents.segments.push_back(std::move(*s));
    }
    if (auto* c = std::get_if<container::ChunkRecord>(&(*record)->body)) {
      contents.chunks.push_back(std::move(*c));
    }
  }
  REQUIRE(reader->finished());
  return contents;
}

}  // namespace relit::player::test
