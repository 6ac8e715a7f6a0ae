// SPDX-License-Identifier: MIT
#include "tests/player/coded_file.hpp"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/frame.h>
}

#include <stdexcept>
#include <utility>

#include "container/byte_sink.hpp"
#include "container/writer.hpp"
#include "decoders/ffmpeg.hpp"
#include "tests/decoders/image_samples.hpp"
#include "tests/decoders/mesh_fixture.hpp"

namespace relit::player::test {
namespace {

using namespace relit::container;
namespace ffmpeg = decoders::ffmpeg;

constexpr int kSide = 16;
constexpr std::uint32_t kSegmentFrames = 2;
enum Track : std::uint32_t { kPoseTrack = 1, kMantissaTrack = 2, kExponentTrack = 3 };

void must(bool condition, const char* what) {
  if (!condition) throw std::runtime_error(what);
}
void must(const Status& status) {
  if (!status) throw std::runtime_error(status.error().message);
}

struct Stream {
  std::vector<std::uint8_t> codec_private;
  std::vector<ChunkRecord> chunks;  ///< by segment
};

ffmpeg::Codec open_encoder(const std::string& codec) {
  const AVCodec* encoder = avcodec_find_encoder_by_name(codec.c_str());
  must(encoder != nullptr, "no such encoder");
  ffmpeg::Codec context(avcodec_alloc_context3(encoder));
  context->width = context->height = kSide;
  context->pix_fmt = codec == "ffv1" ? AV_PIX_FMT_GRAY8 : AV_PIX_FMT_YUV420P;
  context->time_base = {1, 25};
  context->gop_size = kSegmentFrames;
  context->max_b_frames = 0;
  context->level = codec == "ffv1" ? 3 : context->level;
  context->slices = codec == "ffv1" ? 1 : 0;
  context->thread_count = 1;
  context->flags |= AV_CODEC_FLAG_GLOBAL_HEADER | AV_CODEC_FLAG_BITEXACT;
  must(avcodec_open2(context.get(), encoder, nullptr) == 0, "the encoder does not open");
  return context;
}

/// A ramp that moves; component 0 between `low` and `low + span`, the others flat.
ffmpeg::Frame make_picture(const AVCodecContext& context, int number, int low, int span) {
  ffmpeg::Frame frame(av_frame_alloc());
  frame->width = frame->height = kSide;
  frame->format = context.pix_fmt;
  must(av_frame_get_buffer(frame.get(), 0) == 0, "no picture");
  frame->pts = number;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      frame->data[0][y * frame->linesize[0] + x] =
          static_cast<std::uint8_t>(low + (x + y + 3 * number) % span);
  for (int c = 1; c < 3 && frame->data[c] != nullptr; ++c)
    for (int y = 0; y < kSide / 2; ++y)
      std::fill_n(frame->data[c] + y * frame->linesize[c], kSide / 2, std::uint8_t{128});
  return frame;
}

void take_packets(AVCodecContext& context, std::uint32_t track, Stream& stream) {
  const ffmpeg::Packet packet(av_packet_alloc());
  while (avcodec_receive_packet(&context, packet.get()) == 0) {
    const auto segment = static_cast<std::size_t>(packet->pts) / kSegmentFrames;
    stream.chunks.resize(std::max(stream.chunks.size(), segment + 1));
    ChunkRecord& chunk = stream.chunks[segment];
    chunk.track_id = track;
    chunk.packets.push_back({packet->pts, (packet->flags & AV_PKT_FLAG_KEY) != 0, chunk.data.size(),
                             static_cast<std::uint64_t>(packet->size)});
    chunk.data.insert(chunk.data.end(), packet->data, packet->data + packet->size);
    av_packet_unref(packet.get());
  }
}

Stream encode(const std::string& codec, std::uint32_t track, int low, int span) {
  const ffmpeg::Codec context = open_encoder(codec);
  Stream stream;
  stream.codec_private.assign(context->extradata, context->extradata + context->extradata_size);
  for (int i = 0; i < static_cast<int>(kCodedFrames); ++i) {
    const ffmpeg::Frame frame = make_picture(*context, i, low, span);
    must(avcodec_send_frame(context.get(), frame.get()) == 0, "the encoder refuses a picture");
    take_packets(*context, track, stream);
  }
  must(avcodec_send_frame(context.get(), nullptr) == 0, "the encoder does not end");
  take_packets(*context, track, stream);
  return stream;
}

SkeletonRecord skeleton() {
  SkeletonRecord s;
  const Affine identity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  s.nodes = {{-1, identity}};
  s.palette = {{0, identity}};
  return s;
}

PoseTrackRecord pose_track() {
  PoseTrackRecord p;
  p.track_id = kPoseTrack;
  p.clip_id = 7;
  p.channels = {{ChannelTarget::kTranslation, 0, {-1, 0, 0}, {1e-4f, 1e-4f, 1e-4f}}};
  return p;
}

/// Order 0: the residuals are the values, here below 128, so that the high bytes are zero.
ChunkRecord pose_chunk(std::uint32_t segment) {
  constexpr std::uint8_t kValues = 3;
  std::vector<std::uint8_t> plain(1 + 2 * kValues * kSegmentFrames);
  for (std::uint8_t i = 0; i < kValues * kSegmentFrames; ++i)
    plain[1u + i] = static_cast<std::uint8_t>(2 * i + 20 * segment);
  ChunkRecord chunk;
  chunk.track_id = kPoseTrack;
  chunk.data = relit::test::zstd(plain);
  chunk.packets = {{std::int64_t{segment} * kSegmentFrames, true, 0, chunk.data.size()}};
  return chunk;
}

LayerRecord layer(const CodedFile& how, const Stream& mantissas, const Stream& exponents) {
  LayerRecord l;
  l.id = 30;
  l.model_id = 20;
  l.mantissa_track = kMantissaTrack;
  l.codec = how.codec;
  l.codec_private = mantissas.codec_private;
  l.coded_width = l.coded_height = kSide;
  l.chroma = how.codec == "ffv1" ? Chroma::kLuma : Chroma::k420;
  l.lossless = how.codec == "ffv1";
  l.planes = {{0, {0, 0, kSide, kSide}, {1, 2, 4, 4}, 0.25f, {{0, 0, 1}, {0, 1, -1}}}};
  if (!how.exponents) return l;
  l.has_exponents = true;
  l.exponent_track = kExponentTrack;
  l.exponent_codec = "ffv1";
  l.exponent_private = exponents.codec_private;
  l.exponent_width = l.exponent_height = kSide;
  l.exponent_block = 4;
  return l;
}

ModelRecord model() {
  ModelRecord m;
  m.id = 20;
  m.clip_id = 7;
  m.order = 0;
  m.width = m.height = kSide;
  m.mean = {{0.5f, 0.5f, 0.5f}};
  return m;
}

MaterialRecord material() {
  return {9,   "paint", {1, 1, 1, 1}, 3, Wrap::kRepeat, Wrap::kRepeat, false, AlphaMode::kOpaque,
          0.5f};
}

MeshRecord mesh() {
  MeshRecord m = relit::test::quad(1);
  m.material_id = 9;
  return m;
}

void write(Writer& writer, const CodedFile& how) {
  const Stream mantissas = encode(how.codec, kMantissaTrack, 100, 60);
  const Stream exponents = how.exponents ? encode("ffv1", kExponentTrack, 130, 4) : Stream{};
  const std::uint32_t ticks = how.uneven ? 3 : 2;  // of a segment
  must(writer.add(ClipRecord{7,
                             "move",
                             {25, 1},
                             kCodedFrames,
                             true,
                             {-2, -2, -2},
                             {9, 9, 9},
                             std::uint64_t{ticks} * kCodedFrames / kSegmentFrames}));
  const std::vector<std::uint8_t> texels(2 * 2 * 4, 200);
  must(writer.add(ImageRecord{3, "image/png", relit::test::make_rgba_png(2, 2, texels)}));
  must(writer.add(material()));
  must(writer.add(mesh()));
  must(writer.add(skeleton()));
  must(writer.add(pose_track()));
  must(writer.add(model()));
  must(writer.add(layer(how, mantissas, exponents)));
  for (std::uint32_t s = 0; s < kCodedFrames / kSegmentFrames; ++s) {
    SegmentInfo info{7, std::uint64_t{s} * kSegmentFrames, kSegmentFrames};
    if (how.uneven) info.durations = {1, 2};
    std::vector<ChunkRecord> chunks{pose_chunk(s), mantissas.chunks.at(s)};
    if (how.exponents) chunks.push_back(exponents.chunks.at(s));
    must(writer.write_segment(info, std::move(chunks)));
  }
  must(writer.finish());
}

}  // namespace

std::vector<std::uint8_t> coded_file(const CodedFile& how) {
  MemorySink sink;
  auto writer = Writer::create(sink, "coded_file", {how.copies});
  must(writer.has_value(), "no writer");
  write(*writer, how);
  return sink.take();
}

}  // namespace relit::player::test
