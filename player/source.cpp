// SPDX-License-Identifier: MIT
#include "player/source.hpp"

#include <algorithm>

extern "C" {
#include <libavformat/avformat.h>
#include <libavutil/dict.h>
}

#include "decoders/ffmpeg.hpp"

namespace relit::player {
namespace {

class HttpSource final : public container::ByteSource {
 public:
  static Result<std::unique_ptr<container::ByteSource>> open(const std::string& address) {
    AVDictionary* settings = nullptr;
    av_dict_set(&settings, "reconnect", "1", 0);
    av_dict_set(&settings, "reconnect_streamed", "1", 0);
    av_dict_set(&settings, "reconnect_on_http_error", "5xx", 0);
    av_dict_set(&settings, "reconnect_delay_max", "4", 0);
    av_dict_set(&settings, "rw_timeout", "10000000", 0);  // microseconds
    av_dict_set(&settings, "protocol_whitelist", "http,https,tcp,tls", 0);
    AVIOContext* context = nullptr;
    const int code = avio_open2(&context, address.c_str(), AVIO_FLAG_READ, nullptr, &settings);
    av_dict_free(&settings);
    if (code == AVERROR_PROTOCOL_NOT_FOUND) {
      return fail(ErrorCode::kEnvironment, address + ": this FFmpeg does not speak the protocol");
    }
    if (code < 0)
      return fail(ErrorCode::kIo,
                  address + ": cannot be opened: " + decoders::ffmpeg::reason(code));
    return std::unique_ptr<container::ByteSource>(new HttpSource(address, context));
  }

  ~HttpSource() override { avio_closep(&context_); }

  Result<std::size_t> read(std::span<std::uint8_t> out) override {
    const int wanted = static_cast<int>(std::min<std::size_t>(out.size(), 1u << 20));
    const int got = avio_read_partial(context_, out.data(), wanted);
    if (got == AVERROR_EOF || got == 0) return std::size_t{0};
    if (got < 0)
      return fail(ErrorCode::kIo,
                  address_ + ": the connection was lost: " + decoders::ffmpeg::reason(got));
    return static_cast<std::size_t>(got);
  }

  [[nodiscard]] std::optional<std::uint64_t> size() const override {
    const std::int64_t bytes = avio_size(context_);
    if (bytes < 0) return std::nullopt;
    return static_cast<std::uint64_t>(bytes);
  }

  [[nodiscard]] bool seekable() const override {
    return (context_->seekable & AVIO_SEEKABLE_NORMAL) != 0;
  }

  Status seek(std::uint64_t offset_bytes) override {
    if (!seekable())
      return fail(ErrorCode::kUnsupported,
                  address_ + ": the server does not answer Range requests");
    const std::int64_t code =
        avio_seek(context_, static_cast<std::int64_t>(offset_bytes), SEEK_SET);
    if (code < 0) {
      return fail(ErrorCode::kIo, address_ + ": cannot go to byte " + std::to_string(offset_bytes) +
                                      ": " + decoders::ffmpeg::reason(static_cast<int>(code)));
    }
    return {};
  }

 private:
  HttpSource(std::string address, AVIOContext* context)
      : address_(std::move(address)), context_(context) {}

  std::string address_;
  AVIOContext* context_;
};

}  // namespace

Result<std::unique_ptr<container::ByteSource>> open_source(const std::string& source) {
  if (source.rfind("http://", 0) == 0 || source.rfind("https://", 0) == 0)
    return HttpSource::open(source);
  RELIT_ASSIGN(auto file, container::FileSource::open(source));
  return std::unique_ptr<container::ByteSource>(std::move(file));
}

}  // namespace relit::player
