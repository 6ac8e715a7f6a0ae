// SPDX-License-Identifier: MIT
// Streams as FORMAT.md, section 3.4, wants them, and how many pictures their decoders really hold.
extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/imgutils.h>
}

#include <algorithm>
#include <array>
#include <span>

#include "decoders/codec_private.hpp"
#include "decoders/ffmpeg.hpp"
#include "tests/bake_minimal/coding_clip.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::bake;
using namespace relit::bake::test;
using container::Chroma;

namespace {

CodingOptions options_of(const std::string& codec) {
  const bool mpeg4 = codec == "mpeg4";
  return quick(codec, mpeg4 ? 8 : 10, codec == "ffv1" ? Chroma::k444 : Chroma::k420, mpeg4 ? 8 : 0,
               2);
}

/// Pictures that a decoder has not given back.
struct Held {
  int now = 0, most = 0;
};

int count_picture(AVCodecContext* context, AVFrame* frame, int) {
  const auto format = static_cast<AVPixelFormat>(frame->format);
  int width = frame->width, height = frame->height;
  std::array<int, AV_NUM_DATA_POINTERS> alignment{};
  avcodec_align_dimensions2(context, &width, &height, alignment.data());
  const int bytes = av_image_get_buffer_size(format, width + 64, height + 64, 64);
  auto* data = static_cast<std::uint8_t*>(av_malloc(static_cast<std::size_t>(bytes)));
  const auto release = [](void* held, std::uint8_t* memory) {
    --static_cast<Held*>(held)->now;
    av_free(memory);
  };
  frame->buf[0] =
      av_buffer_create(data, static_cast<std::size_t>(bytes), release, context->opaque, 0);
  av_image_fill_arrays(frame->data, frame->linesize, data, format, width + 64, height + 64, 64);
  frame->extended_data = frame->data;
  Held& held = *static_cast<Held*>(context->opaque);
  held.most = std::max(held.most, ++held.now);
  return 0;
}

/// The most pictures that libavcodec holds at once while it decodes a track without threads.
int most_held(const container::LayerRecord& layer, const std::vector<EncodedSegment>& segments) {
  const AVCodecDescriptor* descriptor = avcodec_descriptor_get_by_name(layer.codec.c_str());
  const AVCodec* codec = avcodec_find_decoder(descriptor->id);
  Held held;
  decoders::ffmpeg::Codec context(avcodec_alloc_context3(codec));
  context->width = layer.coded_width;
  context->height = layer.coded_height;
  context->thread_count = 1;
  context->thread_type = FF_THREAD_SLICE;
  context->log_level_offset = decoders::ffmpeg::kQuiet;
  context->opaque = &held;
  context->get_buffer2 = count_picture;
  context->extradata = static_cast<std::uint8_t*>(
      av_mallocz(layer.codec_private.size() + AV_INPUT_BUFFER_PADDING_SIZE));
  std::copy(layer.codec_private.begin(), layer.codec_private.end(), context->extradata);
  context->extradata_size = static_cast<int>(layer.codec_private.size());
  REQUIRE(avcodec_open2(context.get(), codec, nullptr) == 0);
  const decoders::ffmpeg::Packet packet(av_packet_alloc());
  const decoders::ffmpeg::Frame frame(av_frame_alloc());
  for (const EncodedSegment& segment : segments) {
    for (const container::ChunkRecord& chunk : segment.chunks) {
      if (chunk.track_id != layer.mantissa_track) continue;
      for (const container::Packet& p : chunk.packets) {
        REQUIRE(av_new_packet(packet.get(), static_cast<int>(p.size)) == 0);
        std::copy_n(chunk.data.begin() + static_cast<std::ptrdiff_t>(p.offset), p.size,
                    packet->data);
        packet->pts = p.pts;
        REQUIRE(avcodec_send_packet(context.get(), packet.get()) == 0);
        av_packet_unref(packet.get());
        while (avcodec_receive_frame(context.get(), frame.get()) == 0) av_frame_unref(frame.get());
      }
    }
  }
  return held.most;
}

}  // namespace

TEST_CASE("streams of every codec have the form that is stored") {
  const Clip clip = smooth_clip(1, 40, 24, 13);
  for (const std::string codec : {"h264", "hevc", "av1", "vp9", "mpeg4", "ffv1"}) {
    INFO(codec);
    const Encoded encoded = must_encode(clip, options_of(codec));
    for (const container::LayerRecord& layer : encoded.layers) {
      CHECK(decoders::check_private(codec, layer.codec_private));
      CHECK(*decoders::stored_private(codec, layer.codec_private) == layer.codec_private);
      CHECK(layer.codec_private.empty() == (codec == "vp9"));
    }
    for (const EncodedSegment& segment : encoded.segments) {
      for (const container::ChunkRecord& chunk : segment.chunks) {
        const bool exponents = encoded.layers[0].has_exponents && chunk.track_id % 2 == 1;
        for (const container::Packet& p : chunk.packets) {
          const std::span<const std::uint8_t> bytes(chunk.data.data() + p.offset, p.size);
          CHECK(decoders::check_packet(exponents ? "ffv1" : codec, bytes));
        }
      }
    }
  }
}

TEST_CASE("a decoder holds as many pictures as its layer says") {
  const Clip clip = smooth_clip(0, 64, 64, 30);
  for (const std::string codec : {"h264", "hevc", "vp9", "av1", "mpeg4", "ffv1"}) {
    CodingOptions o = options_of(codec);
    o.segment_frames = 15;
    if (codec == "h264" || codec == "hevc") o.preset = "medium";
    const Encoded encoded = must_encode(clip, o);
    const container::LayerRecord& layer = encoded.layers[0];
    const int held = most_held(layer, encoded.segments);
    INFO(codec << " holds " << held << ", the record says " << int{layer.mantissa_pictures});
    // libavcodec may keep one more: of HEVC the one that is shown next, whose place in the
    // standard's buffer is free by then; of FFV1 the one before, to conceal damage.
    CHECK(held <= layer.mantissa_pictures + 1);
    if (layer.has_exponents) CHECK(layer.exponent_pictures == 1);
  }
  CodingOptions more = options_of("h264");
  more.preset = "medium";
  more.reference_frames = 6;
  more.segment_frames = 15;
  CHECK(must_encode(clip, more).layers[0].mantissa_pictures == 7);
}

TEST_CASE("the damage of a stream's headers is an error and nothing worse") {
  const Clip clip = smooth_clip(0, 40, 24, 3);
  for (const std::string codec : {"h264", "hevc", "av1", "mpeg4", "ffv1"}) {
    const Encoded good = must_encode(clip, options_of(codec));
    const std::size_t bytes = good.layers[0].codec_private.size();
    std::uint32_t state = 11;
    for (int round = 0; round < 60; ++round) {
      INFO(codec << " round " << round);
      Encoded bad = good;
      std::vector<std::uint8_t>& headers = bad.layers[0].codec_private;
      state = state * 1664525u + 1013904223u;
      if (round % 2 == 0) {
        headers.resize((state >> 8) % bytes);
      } else {
        headers[(state >> 8) % bytes] ^= static_cast<std::uint8_t>(state >> 3 | 1);
      }
      auto decoder = decoder_with_all(bad);
      if (!decoder) continue;
      decoders::FrameView view;
      for (std::uint64_t f = 0; f < 3; ++f) {
        const Status status = decoder->frame(f, view);
        CHECK(view.planes()[0].mantissa.empty() == !status.has_value());
      }
    }
  }
}
