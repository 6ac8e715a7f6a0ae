// SPDX-License-Identifier: MIT
#include "decoders/plane_decoder.hpp"

extern "C" {
#include <libavcodec/avcodec.h>
}

#include <array>
#include <cmath>
#include <functional>
#include <numeric>

#include "tests/test.hpp"

using namespace relit;
using namespace relit::decoders;
using container::ChunkRecord;
using container::LayerRecord;
using container::ModelRecord;
using container::SegmentRecord;

namespace {

constexpr int kSide = 32;  // of the light map; pictures are as large

/// Grey pictures through FFV1, every one a key picture.
struct Stream {
  std::vector<std::uint8_t> codec_private;
  ChunkRecord chunk;
};

Stream encode(const std::vector<std::vector<std::uint8_t>>& pictures,
              const std::vector<std::int64_t>& pts, std::uint32_t track, int side = kSide) {
  AVCodecContext* context = avcodec_alloc_context3(avcodec_find_encoder(AV_CODEC_ID_FFV1));
  context->width = context->height = side;
  context->pix_fmt = AV_PIX_FMT_GRAY8;
  context->time_base = {1, 25};
  context->gop_size = 1;
  context->level = 3;
  context->slices = 1;
  context->thread_count = 1;
  context->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  REQUIRE(avcodec_open2(context, context->codec, nullptr) == 0);
  Stream stream;
  stream.codec_private.assign(context->extradata, context->extradata + context->extradata_size);
  stream.chunk.track_id = track;
  AVPacket* packet = av_packet_alloc();
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    AVFrame* frame = av_frame_alloc();
    frame->width = frame->height = side;
    frame->format = AV_PIX_FMT_GRAY8;
    REQUIRE(av_frame_get_buffer(frame, 0) == 0);
    for (int y = 0; y < side; ++y) {
      std::copy_n(pictures[i].begin() + y * side, side, frame->data[0] + y * frame->linesize[0]);
    }
    frame->pts = pts[i];
    REQUIRE(avcodec_send_frame(context, frame) == 0);
    av_frame_free(&frame);
    while (avcodec_receive_packet(context, packet) == 0) {
      auto& data = stream.chunk.data;
      stream.chunk.packets.push_back(
          {packet->pts, true, data.size(), static_cast<std::uint64_t>(packet->size)});
      data.insert(data.end(), packet->data, packet->data + packet->size);
      av_packet_unref(packet);
    }
  }
  av_packet_free(&packet);
  avcodec_free_context(&context);
  return stream;
}

std::vector<std::uint8_t> picture(int seed) {
  std::vector<std::uint8_t> samples(kSide * kSide);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i] = static_cast<std::uint8_t>((i * 7 + static_cast<std::size_t>(seed) * 31) % 256);
  }
  return samples;
}

std::vector<std::uint8_t> flat(int value) {
  return std::vector<std::uint8_t>(kSide * kSide, static_cast<std::uint8_t>(value));
}

ModelRecord model() {
  ModelRecord m;
  m.order = 0;
  m.width = m.height = kSide;
  m.mean = {Rgb{0.5f, 0, 0}};
  return m;
}

/// One plane into R (× 2) and G (× -1); exponents in blocks of 8.
LayerRecord layer(const Stream& mantissas, const Stream* exponents) {
  LayerRecord l;
  l.mantissa_track = mantissas.chunk.track_id;
  l.codec = "ffv1";
  l.codec_private = mantissas.codec_private;
  l.coded_width = l.coded_height = kSide;
  l.chroma = container::Chroma::kLuma;
  container::PlaneRecord plane;
  plane.mantissa_rect = {0, 0, kSide, kSide};
  plane.exponent_rect = {3, 5, 4, 4};
  plane.scale = 0.25f;
  plane.matrix = {{0, 0, 2.0f}, {0, 1, -1.0f}};
  l.planes.push_back(plane);
  if (exponents != nullptr) {
    l.has_exponents = true;
    l.exponent_track = exponents->chunk.track_id;
    l.exponent_codec = "ffv1";
    l.exponent_private = exponents->codec_private;
    l.exponent_width = l.exponent_height = kSide;
    l.exponent_block = 8;
  }
  return l;
}

SegmentRecord segment(std::uint64_t first, std::uint32_t count, std::uint32_t index = 0) {
  SegmentRecord s;
  s.index = index;
  s.first_frame = first;
  s.frame_count = count;
  return s;
}

}  // namespace

TEST_CASE("planes hold mantissas, the exponents of their rectangle, and the record's numbers") {
  const Stream mantissas = encode({picture(0)}, {0}, 1), exponents = encode({picture(9)}, {0}, 2);
  const LayerRecord record = layer(mantissas, &exponents);
  auto decoder = PlaneDecoder::open(model(), {&record, 1});
  REQUIRE(decoder);
  REQUIRE(decoder->add_chunk(segment(0, 1), mantissas.chunk));
  REQUIRE(decoder->add_chunk(segment(0, 1), exponents.chunk));
  auto view = decoder->frame(0);
  REQUIRE(view);
  REQUIRE(view->planes().size() == 1);
  const PlaneView& plane = view->planes()[0];
  CHECK(plane.mantissa_zero == 128);
  CHECK(plane.exponent_zero == 135);
  CHECK(plane.exponent_shift == 3);
  CHECK(plane.scale == 0.25f);
  CHECK(plane.exponent.width == 4);
  for (int y = 0; y < kSide; y += 5) {
    for (int x = 0; x < kSide; x += 3) {
      const int m = picture(0)[static_cast<std::size_t>(y * kSide + x)];
      const int e = picture(9)[static_cast<std::size_t>((y / 8 + 5) * kSide + x / 8 + 3)];
      CHECK(plane.mantissa.at(x, y) == m);
      CHECK(plane.exponent.at(x / 8, y / 8) == e);
      CHECK(plane_value(plane, x, y) == (e == 0 ? 0 : 0.25 * (m - 128) * std::exp2(e - 135)));
    }
  }
}

TEST_CASE("reconstruction sums mean and planes through the matrix") {
  const Stream mantissas = encode({picture(4)}, {0}, 1);
  const LayerRecord record = layer(mantissas, nullptr);
  auto decoder = PlaneDecoder::open(model(), {&record, 1});
  REQUIRE(decoder);
  REQUIRE(decoder->add_chunk(segment(0, 1), mantissas.chunk));
  auto view = decoder->frame(0);
  REQUIRE(view);
  std::vector<float> out(3 * kSide * kSide);
  REQUIRE(reconstruct(view->planes(), model(), {&record, 1}, out));
  for (std::size_t p = 0; p < kSide * kSide; ++p) {
    // Multiples of a quarter: exact.
    const float v = 0.25f * static_cast<float>(picture(4)[p] - 128);
    CHECK(out[p] == 0.5f + 2 * v);
    CHECK(out[kSide * kSide + p] == -v);
    CHECK(out[2 * kSide * kSide + p] == 0);
  }
  CHECK(!reconstruct(view->planes(), model(), {&record, 1}, std::span(out).subspan(1)));
  CHECK(!reconstruct({}, model(), {&record, 1}, out));
}

TEST_CASE("a picture holds until the next packet of its segment") {
  const Stream mantissas = encode({flat(10), flat(20), flat(30)}, {0, 2, 3}, 1);
  const Stream exponents = encode({flat(100), flat(101)}, {0, 3}, 2);
  const LayerRecord record = layer(mantissas, &exponents);
  auto decoder = PlaneDecoder::open(model(), {&record, 1});
  REQUIRE(decoder);
  REQUIRE(decoder->add_chunk(segment(0, 6), mantissas.chunk));
  REQUIRE(decoder->add_chunk(segment(0, 6), exponents.chunk));
  const int mantissa[] = {10, 10, 20, 30, 30, 30}, exponent[] = {100, 100, 100, 101, 101, 101};
  for (const int f : {0, 1, 2, 3, 4, 5, 2, 5, 0}) {
    auto view = decoder->frame(static_cast<std::uint64_t>(f));
    REQUIRE(view);
    CHECK(view->planes()[0].mantissa.at(3, 3) == mantissa[f]);
    CHECK(view->planes()[0].exponent.at(1, 1) == exponent[f]);
  }
  CHECK(decoder->frame(6).error().code == ErrorCode::kNotFound);
}

TEST_CASE("damage of one key packet costs the frames that show it") {
  Stream mantissas = encode({flat(10), picture(1), flat(30)}, {0, 1, 2}, 1);
  const auto& hit = mantissas.chunk.packets[1];
  mantissas.chunk.data[hit.offset + hit.size / 2] ^= 0x55;
  const LayerRecord record = layer(mantissas, nullptr);
  auto decoder = PlaneDecoder::open(model(), {&record, 1});
  REQUIRE(decoder);
  REQUIRE(decoder->add_chunk(segment(0, 3), mantissas.chunk));
  FrameView view;
  CHECK(decoder->frame(0, view));
  const Status lost = decoder->frame(1, view);
  REQUIRE(!lost);
  CHECK(lost.error().code == ErrorCode::kCorrupt);
  CHECK(lost.error().message.find("track 1, frame 1") != std::string::npos);
  CHECK(decoder->frame(2, view));
  CHECK(view.planes()[0].mantissa.at(0, 0) == 30);
}

TEST_CASE("chunks whose packets lie outside their bytes or frames are refused") {
  const Stream good = encode({flat(1), flat(2)}, {4, 5}, 1);
  const LayerRecord record = layer(good, nullptr);
  const std::function<void(ChunkRecord&)> damages[] = {
      [](ChunkRecord& c) { c.packets[1].size += 1; },
      [](ChunkRecord& c) { c.packets[0].offset = ~0ull; },
      [](ChunkRecord& c) { c.packets[0].size = ~0ull; },
      [](ChunkRecord& c) { c.packets[0].pts = 3; },
      [](ChunkRecord& c) { c.packets[1].pts = 6; },
      [](ChunkRecord& c) { c.packets[1].pts = 4; },
      [](ChunkRecord& c) { c.packets[1].pts = INT64_MIN; },
      [](ChunkRecord& c) { c.data.clear(); },
  };
  for (const auto& damage : damages) {
    auto decoder = PlaneDecoder::open(model(), {&record, 1});
    REQUIRE(decoder);
    ChunkRecord chunk = good.chunk;
    damage(chunk);
    const Status status = decoder->add_chunk(segment(4, 2), chunk);
    REQUIRE(!status);
    CHECK(status.error().code == ErrorCode::kCorrupt);
    // The decoder is none the worse.
    REQUIRE(decoder->add_chunk(segment(4, 2), good.chunk));
    CHECK(decoder->frame(5));
  }
  auto decoder = PlaneDecoder::open(model(), {&record, 1});
  REQUIRE(decoder);
  CHECK(!decoder->add_chunk(segment(4, 0), good.chunk));
  REQUIRE(decoder->add_chunk(segment(4, 2), good.chunk));
  CHECK(!decoder->add_chunk(segment(3, 3), good.chunk));
  CHECK(decoder->add_chunk(segment(4, 2), good.chunk));
  CHECK(decoder->frame(4));
}

TEST_CASE("a segment that does not begin with a key packet is lost") {
  Stream stream = encode({flat(1), flat(2)}, {0, 1}, 1);
  stream.chunk.packets[0].key = false;
  const LayerRecord record = layer(stream, nullptr);
  auto decoder = PlaneDecoder::open(model(), {&record, 1});
  REQUIRE(decoder);
  REQUIRE(decoder->add_chunk(segment(0, 2), stream.chunk));
  CHECK(!decoder->frame(0));
  CHECK(decoder->frame(1));
}

TEST_CASE("records that make no sense are refused before anything is decoded") {
  const Stream mantissas = encode({picture(0)}, {0}, 1), exponents = encode({picture(1)}, {0}, 2);
  const std::function<void(ModelRecord&, LayerRecord&)> damages[] = {
      [](ModelRecord& m, LayerRecord&) { m.order = 4; },
      [](ModelRecord& m, LayerRecord&) { m.width = 0; },
      [](ModelRecord& m, LayerRecord&) { m.width = 31; },
      [](ModelRecord&, LayerRecord& l) { l.bit_depth = 9; },
      [](ModelRecord&, LayerRecord& l) { l.exponent_block = 3; },
      [](ModelRecord&, LayerRecord& l) { l.exponent_block = 0; },
      [](ModelRecord&, LayerRecord& l) { l.exponent_block = 64; },
      [](ModelRecord&, LayerRecord& l) { l.exponent_codec = "h264"; },
      [](ModelRecord&, LayerRecord& l) { l.exponent_width = 6; },
      [](ModelRecord&, LayerRecord& l) { l.codec = "rawvideo"; },
      [](ModelRecord&, LayerRecord& l) { l.codec = "h264\nx"; },
      [](ModelRecord&, LayerRecord& l) { l.coded_width = 16; },
      [](ModelRecord&, LayerRecord& l) { l.coded_width = 65535; },
      [](ModelRecord&, LayerRecord& l) {
        l.codec_private = {1, 2, 3};
      },
      [](ModelRecord&, LayerRecord& l) { l.chroma = static_cast<container::Chroma>(7); },
      [](ModelRecord&, LayerRecord& l) { l.planes[0].component = 1; },
      [](ModelRecord&, LayerRecord& l) { l.planes[0].mantissa_rect.x = 1; },
      [](ModelRecord&, LayerRecord& l) { l.planes[0].mantissa_rect.width = 65535; },
      [](ModelRecord&, LayerRecord& l) { l.planes[0].exponent_rect.width = 5; },
      [](ModelRecord&, LayerRecord& l) { l.planes[0].exponent_rect.y = 29; },
      [](ModelRecord&, LayerRecord& l) { l.planes[0].scale = 0; },
      [](ModelRecord&, LayerRecord& l) { l.planes[0].scale = -1; },
      [](ModelRecord&, LayerRecord& l) { l.planes[0].scale = NAN; },
      [](ModelRecord&, LayerRecord& l) { l.planes[0].matrix[0].value = INFINITY; },
      [](ModelRecord&, LayerRecord& l) { l.planes[0].matrix[0].coefficient = 1; },
      [](ModelRecord&, LayerRecord& l) { l.planes[0].matrix[0].channel = 3; },
      [](ModelRecord&, LayerRecord& l) { l.planes.resize(257, l.planes[0]); },
  };
  for (std::size_t i = 0; i < std::size(damages); ++i) {
    ModelRecord m = model();
    LayerRecord record = layer(mantissas, &exponents);
    REQUIRE(PlaneDecoder::open(m, {&record, 1}));
    damages[i](m, record);
    INFO("damage " << i);
    auto decoder = PlaneDecoder::open(m, {&record, 1});
    if (!decoder) continue;
    // A wrong picture size can only show when the stream has to fit it.
    REQUIRE(decoder->add_chunk(segment(0, 1), mantissas.chunk));
    REQUIRE(decoder->add_chunk(segment(0, 1), exponents.chunk));
    CHECK(!decoder->frame(0));
  }
}

TEST_CASE("4:2:0 planes have to lie on even places") {
  const Stream mantissas = encode({picture(0)}, {0}, 1);
  LayerRecord record = layer(mantissas, nullptr);
  record.coded_width = 64;
  record.chroma = container::Chroma::k420;
  record.planes[0].component = 1;
  record.planes[0].mantissa_rect.x = 2;
  CHECK(check_layer(model(), record));
  record.planes[0].mantissa_rect.x = 3;
  CHECK(!check_layer(model(), record));
  record.planes[0].component = 0;
  CHECK(check_layer(model(), record));
}

TEST_CASE("every truncation of a packet gives the picture or an error") {
  const Stream good = encode({picture(3)}, {0}, 1);
  const LayerRecord record = layer(good, nullptr);
  for (std::uint64_t size = 0; size <= good.chunk.packets[0].size; size += 3) {
    ChunkRecord chunk = good.chunk;
    chunk.packets[0].size = size;
    auto decoder = PlaneDecoder::open(model(), {&record, 1});
    REQUIRE(decoder);
    REQUIRE(decoder->add_chunk(segment(0, 1), chunk));
    FrameView view;
    const Status status = decoder->frame(0, view);
    CHECK(status.has_value() == (size == good.chunk.packets[0].size));
    CHECK(view.planes()[0].mantissa.empty() == !status.has_value());
  }
}

TEST_CASE("picture bytes count the samples of every chroma format") {
  CHECK(picture_bytes(32, 16, container::Chroma::kLuma, 8) == 512);
  CHECK(picture_bytes(32, 16, container::Chroma::k420, 8) == 768);
  CHECK(picture_bytes(33, 17, container::Chroma::k420, 10) == 2 * (33 * 17 + 2 * 17 * 9));
  CHECK(picture_bytes(32, 16, container::Chroma::k444, 10) == 3072);
}

TEST_CASE("pictures that are not shown are passed over, in any order of packets") {
  constexpr int kFrames = 12;
  std::vector<std::vector<std::uint8_t>> pictures;
  std::vector<std::int64_t> pts;
  for (int i = 0; i < kFrames; ++i) {
    pictures.push_back(picture(i));
    pts.push_back(i);
  }
  Stream stream = encode(pictures, pts, 1);
  const LayerRecord record = layer(stream, nullptr);
  // Decode order 0 2 1 3 4 …: frame 1 comes behind one that is shown later.
  std::swap(stream.chunk.packets[1], stream.chunk.packets[2]);
  auto track = TrackDecoder::open(mantissa_format(record));
  REQUIRE(track);
  track->show_every(4);
  REQUIRE(track->add_chunk(segment(0, kFrames), stream.chunk));
  const auto shows = [&](std::uint64_t frame) {
    const auto shown = track->picture(frame);
    REQUIRE(shown);
    CHECK((*shown)->pts() == static_cast<std::int64_t>(frame));
    CHECK((*shown)->component(0).at(5, 0) == pictures[frame][5]);
  };
  for (const std::uint64_t frame : {0u, 4u, 8u}) shows(frame);
  CHECK(track->pictures() == 3);
  // One that was passed over, and those that follow it.
  for (const std::uint64_t frame : {5u, 8u, 0u, 11u, 4u}) shows(frame);
}
