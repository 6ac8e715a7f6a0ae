// SPDX-License-Identifier: MIT
#include "player/matroska.hpp"

#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <filesystem>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/mem.h>
}

#include "container/base/limits.hpp"
#include "decoders/ffmpeg.hpp"

namespace relit::player {
namespace {

namespace ffmpeg = decoders::ffmpeg;

constexpr const char* kTrackTag = "RELIT_TRACK";
constexpr AVRational kNanoseconds{1, 1'000'000'000};

Status set_parameters(const MatroskaTrack& track, AVCodecParameters& parameters) {
  const AVCodecDescriptor* codec = avcodec_descriptor_get_by_name(track.codec.c_str());
  if (codec == nullptr || codec->type != AVMEDIA_TYPE_VIDEO) {
    return fail(ErrorCode::kUnsupported, "track " + std::to_string(track.track_id) +
                                             ": this FFmpeg knows no video codec \"" + track.codec +
                                             "\"");
  }
  parameters.codec_type = AVMEDIA_TYPE_VIDEO;
  parameters.codec_id = codec->id;
  parameters.width = track.width;
  parameters.height = track.height;
  parameters.color_range = AVCOL_RANGE_JPEG;
  if (track.codec_private.empty()) return {};
  parameters.extradata = static_cast<std::uint8_t*>(
      av_mallocz(track.codec_private.size() + AV_INPUT_BUFFER_PADDING_SIZE));
  if (parameters.extradata == nullptr) return fail(ErrorCode::kOutOfMemory, "out of memory");
  std::copy(track.codec_private.begin(), track.codec_private.end(), parameters.extradata);
  parameters.extradata_size = static_cast<int>(track.codec_private.size());
  return {};
}

}  // namespace

struct MatroskaWriter::State {
  AVFormatContext* muxer = nullptr;
  ffmpeg::Packet packet{av_packet_alloc()};
  std::filesystem::path path, part;

  ~State() {
    if (muxer != nullptr && muxer->pb != nullptr) avio_closep(&muxer->pb);
    avformat_free_context(muxer);
    std::error_code ignored;
    if (!part.empty()) std::filesystem::remove(part, ignored);
  }

  [[nodiscard]] Unexpected unwritable(int code) const {
    return fail(ErrorCode::kIo, path.string() + ": cannot be written: " + ffmpeg::reason(code));
  }

  Status add_stream(const MatroskaTrack& track) const {
    AVStream* stream = avformat_new_stream(muxer, nullptr);
    if (stream == nullptr) return fail(ErrorCode::kOutOfMemory, "out of memory");
    stream->time_base = kNanoseconds;
    av_dict_set(&stream->metadata, kTrackTag, std::to_string(track.track_id).c_str(), 0);
    av_dict_set(&stream->metadata, "title", track.title.c_str(), 0);
    stream->avg_frame_rate = {static_cast<int>(track.frame_rate.num),
                              static_cast<int>(track.frame_rate.den)};
    RELIT_TRY(set_parameters(track, *stream->codecpar));
    if (avformat_query_codec(muxer->oformat, stream->codecpar->codec_id, FF_COMPLIANCE_NORMAL) !=
        1) {
      return fail(ErrorCode::kUnsupported, "track " + std::to_string(track.track_id) +
                                               ": Matroska has no place for the codec \"" +
                                               track.codec + "\"");
    }
    return {};
  }

  // Not through FileSink: the muxer goes back to fill in sizes.
  Status write_header() {
    part = path;
    part += "." + std::to_string(::getpid()) + ".part";
    const std::string address = "file:" + part.string();
    muxer->url = av_strdup(address.c_str());
    // The same packets give the same file, and their times are not moved.
    muxer->flags |= AVFMT_FLAG_BITEXACT;
    muxer->avoid_negative_ts = AVFMT_AVOID_NEG_TS_DISABLED;
    int code = avio_open(&muxer->pb, address.c_str(), AVIO_FLAG_WRITE);
    if (code >= 0) code = avformat_write_header(muxer, nullptr);
    if (code < 0) return unwritable(code);
    return {};
  }
};

MatroskaWriter::MatroskaWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
MatroskaWriter::MatroskaWriter(MatroskaWriter&&) noexcept = default;
MatroskaWriter& MatroskaWriter::operator=(MatroskaWriter&&) noexcept = default;
MatroskaWriter::~MatroskaWriter() = default;

Result<MatroskaWriter> MatroskaWriter::create(const std::string& path, const std::string& title,
                                              std::vector<MatroskaTrack> tracks) {
  auto state = std::make_unique<State>();
  state->path = path;
  if (!state->packet ||
      avformat_alloc_output_context2(&state->muxer, nullptr, "matroska", nullptr) < 0) {
    return fail(ErrorCode::kEnvironment, path + ": this FFmpeg cannot write Matroska");
  }
  av_dict_set(&state->muxer->metadata, "title", title.c_str(), 0);
  for (const MatroskaTrack& track : tracks) RELIT_TRY(state->add_stream(track));
  RELIT_TRY(state->write_header());
  return MatroskaWriter(std::move(state));
}

std::int64_t MatroskaWriter::resolution_ns() const {
  std::int64_t coarsest = 1;
  for (unsigned i = 0; i < state_->muxer->nb_streams; ++i) {
    const AVRational base = state_->muxer->streams[i]->time_base;
    coarsest = std::max(coarsest, av_rescale_q(1, base, kNanoseconds));
  }
  return coarsest;
}

Status MatroskaWriter::add(std::size_t track, std::span<const std::uint8_t> packet, bool key,
                           const Timing& timing) {
  AVPacket& out = *state_->packet;
  if (packet.size() > limits::kRecordBytes ||
      av_new_packet(&out, static_cast<int>(packet.size())) < 0) {
    return fail(ErrorCode::kOutOfMemory, "no memory for a packet");
  }
  std::memcpy(out.data, packet.data(), packet.size());
  out.pts = timing.time_ns;
  out.dts = timing.decode_ns;
  out.duration = timing.duration_ns;
  out.flags = key ? AV_PKT_FLAG_KEY : 0;
  out.stream_index = static_cast<int>(track);
  av_packet_rescale_ts(&out, kNanoseconds, state_->muxer->streams[track]->time_base);
  const int code = av_interleaved_write_frame(state_->muxer, &out);
  if (code < 0) return state_->unwritable(code);
  return {};
}

Status MatroskaWriter::finish() {
  int code = av_write_trailer(state_->muxer);
  const int closed = avio_closep(&state_->muxer->pb);
  if (code >= 0) code = closed;
  if (code < 0) return state_->unwritable(code);
  std::error_code error;
  std::filesystem::rename(state_->part, state_->path, error);
  if (error) {
    return fail(ErrorCode::kIo, state_->path.string() + ": cannot be written: " + error.message());
  }
  state_->part.clear();
  return {};
}

struct MatroskaReader::State {
  AVFormatContext* demuxer = nullptr;
  ffmpeg::Packet packet{av_packet_alloc()};
  std::string path;
  std::vector<MatroskaTrack> tracks;
  std::vector<std::optional<std::size_t>> track_of_stream;

  ~State() { avformat_close_input(&demuxer); }

  Status note_stream(const AVStream& stream) {
    track_of_stream.emplace_back();
    const AVDictionaryEntry* tag = av_dict_get(stream.metadata, kTrackTag, nullptr, 0);
    if (tag == nullptr || stream.codecpar->codec_type != AVMEDIA_TYPE_VIDEO) return {};
    MatroskaTrack track;
    const char* end = tag->value + std::strlen(tag->value);
    const auto [at, error] = std::from_chars(tag->value, end, track.track_id);
    const bool twice = std::any_of(tracks.begin(), tracks.end(), [&](const MatroskaTrack& t) {
      return t.track_id == track.track_id;
    });
    if (error != std::errc() || at != end || twice) {
      return fail(ErrorCode::kCorrupt,
                  path + ": stream " + std::to_string(stream.index) + ": its tag " + kTrackTag +
                      " is \"" + tag->value + "\", " +
                      (twice ? "as that of another stream" : "which is not the number of a track"));
    }
    const AVCodecParameters& parameters = *stream.codecpar;
    track.codec = avcodec_get_name(parameters.codec_id);
    track.codec_private.assign(parameters.extradata,
                               parameters.extradata + parameters.extradata_size);
    track.width = parameters.width;
    track.height = parameters.height;
    track_of_stream.back() = tracks.size();
    tracks.push_back(std::move(track));
    return {};
  }
};

MatroskaReader::MatroskaReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
MatroskaReader::MatroskaReader(MatroskaReader&&) noexcept = default;
MatroskaReader& MatroskaReader::operator=(MatroskaReader&&) noexcept = default;
MatroskaReader::~MatroskaReader() = default;

Result<MatroskaReader> MatroskaReader::open(const std::string& path) {
  auto state = std::make_unique<State>();
  state->path = path;
  state->demuxer = avformat_alloc_context();
  const AVInputFormat* matroska = av_find_input_format("matroska");
  if (!state->packet || state->demuxer == nullptr || matroska == nullptr) {
    return fail(ErrorCode::kEnvironment, path + ": this FFmpeg cannot read Matroska");
  }
  // Packets, key flags and times as they are stored, not as a parser would have them.
  state->demuxer->flags |= AVFMT_FLAG_NOPARSE | AVFMT_FLAG_NOFILLIN;
  const int code =
      avformat_open_input(&state->demuxer, ("file:" + path).c_str(), matroska, nullptr);
  if (code < 0) {
    return fail(code == AVERROR_INVALIDDATA ? ErrorCode::kCorrupt : ErrorCode::kIo,
                path + ": cannot be read as Matroska: " + ffmpeg::reason(code));
  }
  for (unsigned i = 0; i < state->demuxer->nb_streams; ++i) {
    RELIT_TRY(state->note_stream(*state->demuxer->streams[i]));
  }
  return MatroskaReader(std::move(state));
}

const std::vector<MatroskaTrack>& MatroskaReader::tracks() const { return state_->tracks; }

std::int64_t MatroskaReader::resolution_ns() const {
  std::int64_t coarsest = 1;
  for (unsigned i = 0; i < state_->demuxer->nb_streams; ++i) {
    const AVRational base = state_->demuxer->streams[i]->time_base;
    coarsest = std::max(coarsest, av_rescale_q(1, base, kNanoseconds));
  }
  return coarsest;
}

Result<std::optional<MatroskaPacket>> MatroskaReader::next() {
  AVPacket& in = *state_->packet;
  for (;;) {
    av_packet_unref(&in);
    const int code = av_read_frame(state_->demuxer, &in);
    if (code == AVERROR_EOF) return std::optional<MatroskaPacket>();
    if (code < 0) {
      return fail(code == AVERROR(EIO) ? ErrorCode::kIo : ErrorCode::kCorrupt,
                  state_->path + ": cannot be read further: " + ffmpeg::reason(code));
    }
    const auto stream = static_cast<std::size_t>(in.stream_index);
    // Streams may appear in mid-file; those have no track.
    if (stream >= state_->track_of_stream.size() || !state_->track_of_stream[stream]) continue;
    const std::size_t track = *state_->track_of_stream[stream];
    // What Matroska has no name of its own for (with FFmpeg 5.1, FFV1) it stores as AVI would: with
    // decoding times.
    const AVCodecDescriptor* codec =
        avcodec_descriptor_get(state_->demuxer->streams[stream]->codecpar->codec_id);
    const bool reorders = codec == nullptr || (codec->props & AV_CODEC_PROP_REORDER) != 0;
    if (in.pts == AV_NOPTS_VALUE && !reorders) in.pts = in.dts;
    if (in.pts == AV_NOPTS_VALUE || in.size <= 0 || (in.flags & AV_PKT_FLAG_CORRUPT) != 0) {
      return fail(ErrorCode::kCorrupt, state_->path + ": track " +
                                           std::to_string(state_->tracks[track].track_id) +
                                           ": a packet that is empty, damaged or without a time");
    }
    MatroskaPacket packet;
    packet.track = track;
    packet.time_ns =
        av_rescale_q(in.pts, state_->demuxer->streams[stream]->time_base, kNanoseconds);
    packet.key = (in.flags & AV_PKT_FLAG_KEY) != 0;
    packet.bytes.assign(in.data, in.data + in.size);
    return std::optional(std::move(packet));
  }
}

}  // namespace relit::player
