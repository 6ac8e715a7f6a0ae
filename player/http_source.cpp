// SPDX-License-Identifier: MIT
#include "player/http_source.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <string_view>
#include <thread>
#include <utility>

extern "C" {
#include <libavformat/avformat.h>
#include <libavutil/dict.h>
}

#include "decoders/ffmpeg.hpp"

namespace relit::player {
namespace {

using namespace std::chrono_literals;

/// Signature and header; what comes after them is announced as a rule.
constexpr std::uint64_t kFirstWindowBytes = 512;
constexpr std::uint64_t kLargestWindowBytes = std::uint64_t{1} << 20;
/// Up to here, reading on is cheaper than a new connection; where bytes are spared, the Reader has
/// already decided what is worth reading through.
constexpr std::uint64_t kReadThroughBytes = std::uint64_t{1} << 16;
constexpr auto kFirstPause = 100ms;
constexpr auto kLongestPause = 2000ms;
constexpr auto kPoll = 20ms;

std::chrono::steady_clock::duration seconds(double s) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(s));
}

bool is_header_name(std::string_view name) {
  constexpr std::string_view kAllowed = "!#$%&'*+-.^_`|~";
  return !name.empty() && std::ranges::all_of(name, [&](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           kAllowed.find(c) != std::string_view::npos;
  });
}

bool equal_names(std::string_view a, std::string_view b) {
  return std::ranges::equal(a, b, [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) ==
           std::tolower(static_cast<unsigned char>(y));
  });
}

bool is_4xx(int code) {
  constexpr std::array kCodes{AVERROR_HTTP_BAD_REQUEST, AVERROR_HTTP_UNAUTHORIZED,
                              AVERROR_HTTP_FORBIDDEN, AVERROR_HTTP_NOT_FOUND,
                              AVERROR_HTTP_OTHER_4XX};
  return std::ranges::find(kCodes, code) != kCodes.end();
}

std::string at_byte(std::uint64_t offset) { return "at byte " + std::to_string(offset); }

std::string with_unit(double timeout_s) {
  std::string text = std::to_string(timeout_s);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text + " s";
}

}  // namespace

bool is_http_address(const std::string& source) {
  return source.rfind("http://", 0) == 0 || source.rfind("https://", 0) == 0;
}

Result<std::unique_ptr<HttpSource>> HttpSource::open(const std::string& address,
                                                     const SourceOptions& options) {
  std::unique_ptr<HttpSource> source(new HttpSource(address, options));
  RELIT_TRY(source->set_headers());
  RELIT_TRY(source->first_request());
  return source;
}

HttpSource::~HttpSource() { disconnect(); }

void HttpSource::disconnect() {
  if (context_ == nullptr) return;
  done_.bytes += static_cast<std::uint64_t>(std::max<std::int64_t>(0, context_->bytes_read));
  avio_closep(&context_);
}

HttpSource::Traffic HttpSource::traffic() const {
  Traffic all = done_;
  if (context_ != nullptr)
    all.bytes += static_cast<std::uint64_t>(std::max<std::int64_t>(0, context_->bytes_read));
  return all;
}

// A line break inside would smuggle in a header, or a request, that nobody sees.
Status HttpSource::set_headers() {
  for (const std::string& header : options_.http_headers) {
    const std::size_t colon = header.find(':');
    const std::string_view name = std::string_view(header).substr(0, colon);
    const bool printable =
        std::ranges::none_of(header, [](char c) { return c == '\r' || c == '\n' || c == '\0'; });
    if (colon == std::string::npos || !is_header_name(name) || !printable)
      return fail(ErrorCode::kInvalid,
                  "HTTP header \"" + header + "\": the form is \"Name: value\", on one line");
    if (equal_names(name, "Range"))
      return fail(ErrorCode::kInvalid,
                  "HTTP header \"" + header + "\": ranges are chosen by relit itself");
    headers_ += header + "\r\n";
  }
  return {};
}

void HttpSource::arm(double timeout_s) {
  deadline_ = Clock::now() + seconds(timeout_s);
  cancelled_ = false;
}

int HttpSource::interrupted() {
  if (options_.interrupt && options_.interrupt()) cancelled_ = true;
  return cancelled_ || Clock::now() > deadline_ ? 1 : 0;
}

int HttpSource::poll_interrupt(void* self) { return static_cast<HttpSource*>(self)->interrupted(); }

/// Closes the connection and says why it is of no more use.
Unexpected HttpSource::failed(const std::string& doing, int code, double timeout_s) {
  disconnect();
  retryable_ = false;
  if (cancelled_) return fail(ErrorCode::kCancelled, address_ + ": cancelled");
  if (code == AVERROR_PROTOCOL_NOT_FOUND)
    return fail(ErrorCode::kEnvironment, address_ + ": this FFmpeg does not speak the protocol");
  retryable_ = !is_4xx(code);
  std::string reason = decoders::ffmpeg::reason(code);
  if (code == AVERROR_EXIT) reason = "nothing came for " + with_unit(timeout_s);
  return fail(ErrorCode::kIo, address_ + ": " + doing + ": " + reason);
}

/// The end of the range to ask for from `begin` on; 0: all there is.
std::uint64_t HttpSource::range_end(std::uint64_t begin) {
  if (!options_.sparing) return 0;
  std::uint64_t end = expected_end_;
  if (begin < expected_begin_ || begin >= expected_end_) {
    window_ = begin == window_end_ ? std::min(2 * window_, kLargestWindowBytes) : 0;
    window_ = std::max(window_, kFirstWindowBytes);
    end = window_end_ = begin + window_;
  }
  return size_ ? std::min(end, *size_) : end;
}

/// What libavformat is to do with a request for [begin, end_). The caller frees it.
AVDictionary* HttpSource::request_settings(std::uint64_t begin) const {
  AVDictionary* settings = nullptr;
  av_dict_set(&settings, "offset", std::to_string(begin).c_str(), 0);
  // An open end would let the server fill every buffer on the way with what is never read.
  if (end_ != 0) av_dict_set(&settings, "end_offset", std::to_string(end_).c_str(), 0);
  av_dict_set(&settings, "protocol_whitelist", "http,https,httpproxy,tcp,tls", 0);
  if (!headers_.empty()) av_dict_set(&settings, "headers", headers_.c_str(), 0);
  // TCP's own limit, 5 s unless told otherwise, must not be the shorter one: poll_interrupt() ends
  // what takes too long.
  const double longest_s = std::max(options_.connect_timeout_s, options_.read_timeout_s) + 1;
  av_dict_set_int(&settings, "timeout", std::llround(std::min(longest_s, 2000.0) * 1e6), 0);
  return settings;
}

Status HttpSource::request(std::uint64_t begin) {
  disconnect();
  const bool whole = size_ && !ranges_;
  end_ = whole ? 0 : range_end(begin);
  AVDictionary* settings = request_settings(begin);
  const AVIOInterruptCB interrupt{&poll_interrupt, this};
  arm(options_.connect_timeout_s);
  ++done_.requests;
  const int code = avio_open2(&context_, address_.c_str(), AVIO_FLAG_READ, &interrupt, &settings);
  av_dict_free(&settings);
  if (code < 0) return refused(begin, code);
  at_ = begin;
  return check_answer(begin);
}

Unexpected HttpSource::refused(std::uint64_t begin, int code) {
  std::string doing = begin == 0 ? "cannot be opened" : "cannot go on " + at_byte(begin);
  // So libavformat says that an answer begins elsewhere than was asked.
  const bool elsewhere = code == AVERROR(EPERM) && begin != 0;
  if (elsewhere) doing += ": the server sends the file from its beginning, not the range asked for";
  if (code == AVERROR(EIO)) doing += ": no answer, or more than 8 redirects";
  auto failure = failed(doing, code, options_.connect_timeout_s);
  if (elsewhere) retryable_ = false;
  return failure;
}

Status HttpSource::check_answer(std::uint64_t begin) {
  const std::int64_t bytes = avio_size(context_);
  if (bytes >= 0 && size_ && static_cast<std::uint64_t>(bytes) != *size_) {
    disconnect();
    retryable_ = false;
    return fail(ErrorCode::kIo, address_ + ": changed while it was read: it had " +
                                    std::to_string(*size_) + " bytes, " + at_byte(begin) +
                                    " it has " + std::to_string(bytes));
  }
  if (bytes >= 0) size_ = static_cast<std::uint64_t>(bytes);
  return {};
}

Status HttpSource::first_request() {
  RELIT_TRY(request(0));
  ranges_ = (context_->seekable & AVIO_SEEKABLE_NORMAL) != 0;
  if (ranges_) return {};
  if (options_.warn)
    options_.warn(address_ +
                  ": the server does not answer Range requests: it can only be played forward, "
                  "and is fetched in whole");
  if (!std::exchange(options_.sparing, false)) return {};
  // libavformat stops at the end it was told, although the server sends on.
  return request(0);
}

Status HttpSource::seek(std::uint64_t offset_bytes) {
  if (!seekable())
    return fail(ErrorCode::kUnsupported, address_ + ": the server does not answer Range requests");
  position_ = offset_bytes;
  return {};
}

void HttpSource::expect(std::uint64_t begin_bytes, std::uint64_t end_bytes) {
  expected_begin_ = begin_bytes;
  expected_end_ = end_bytes;
}

/// Makes the connection stand where the user stands.
Status HttpSource::reach_position() {
  const bool ahead = context_ != nullptr && position_ >= at_ &&
                     position_ - at_ <= kReadThroughBytes && (end_ == 0 || position_ < end_);
  if (!ahead) return request(position_);
  std::array<std::uint8_t, 4096> passed;
  while (at_ < position_) {
    const auto step = std::min<std::uint64_t>(position_ - at_, passed.size());
    RELIT_ASSIGN(const std::size_t got,
                 receive(std::span(passed).first(static_cast<std::size_t>(step))));
    if (got == 0) return failed("cannot go to byte " + std::to_string(position_), AVERROR_EOF, 0);
  }
  return {};
}

/// Reads at least a byte from the connection; 0: the end of a file whose length nobody told.
Result<std::size_t> HttpSource::receive(std::span<std::uint8_t> out) {
  auto wanted = std::min<std::uint64_t>(out.size(), kLargestWindowBytes);
  if (end_ != 0) wanted = std::min(wanted, end_ - at_);
  // libavformat hands on what a server sends beyond the length it announced.
  if (size_) wanted = std::min(wanted, *size_ - at_);
  arm(options_.read_timeout_s);
  const int got = avio_read_partial(context_, out.data(), static_cast<int>(wanted));
  if (got > 0) {
    at_ += static_cast<std::uint64_t>(got);
    return static_cast<std::size_t>(got);
  }
  const bool ended = got == 0 || got == AVERROR_EOF;
  if (ended && !size_) return std::size_t{0};
  const std::string of = size_ ? " of " + std::to_string(*size_) : "";
  return failed("the connection was lost " + at_byte(at_) + of, ended ? AVERROR_EOF : got,
                options_.read_timeout_s);
}

/// Waits before the next attempt. Errors: `failure` where there should be none, kCancelled.
Status HttpSource::try_again(Error failure, std::optional<Retry>& retry) {
  if (!retryable_) return Unexpected{std::move(failure)};
  if (!ranges_ && position_ != 0) {
    failure.message +=
        "; the server does not answer Range requests, so it cannot be taken up again";
    return Unexpected{std::move(failure)};
  }
  const auto now = Clock::now();
  if (!retry) retry = Retry{now + seconds(options_.retry_s), kFirstPause};
  if (now + retry->pause > retry->until) return Unexpected{std::move(failure)};
  arm(std::chrono::duration<double>(retry->pause).count());
  while (interrupted() == 0) std::this_thread::sleep_for(kPoll);
  if (cancelled_) return fail(ErrorCode::kCancelled, address_ + ": cancelled");
  retry->pause = std::min<std::chrono::milliseconds>(2 * retry->pause, kLongestPause);
  return {};
}

Result<std::size_t> HttpSource::read(std::span<std::uint8_t> out) {
  if (size_ && position_ >= *size_) return std::size_t{0};
  std::optional<Retry> retry;
  for (;;) {
    auto status = reach_position();
    auto got = status ? receive(out) : Result<std::size_t>(Unexpected{std::move(status).error()});
    if (got) {
      position_ += *got;
      return got;
    }
    RELIT_TRY(try_again(std::move(got).error(), retry));
  }
}

}  // namespace relit::player
