// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "container/base/result.hpp"
#include "container/byte_source.hpp"
#include "player/source.hpp"

struct AVDictionary;
struct AVIOContext;

namespace relit::player {

[[nodiscard]] bool is_http_address(const std::string& source);

/// A file on an HTTP server, through libavformat.
///
/// Requests are for byte ranges, and begin where reading goes on: after a seek, behind the range
/// that was asked for, and where a connection broke. Breaks, stalls and 5xx answers are retried for
/// retry_s with growing pauses as long as no byte comes; 4xx answers are not. The file's length is
/// compared between requests: one that changed while it was read is an error. (A change that keeps
/// the length can be seen by the records' checksums alone: libavformat hides ETag and
/// Last-Modified.) A server that does not answer Range requests is read from front to back, which
/// the user is warned of once. At most 8 redirects are followed. One thread at a time.
class HttpSource final : public container::ByteSource {
 public:
  /// Sends the first request. Errors: kIo with the server's status or the system's reason; kInvalid
  /// for a header that is not "Name: value" or is Range; kCancelled; kEnvironment where this FFmpeg
  /// does not speak the protocol.
  static Result<std::unique_ptr<HttpSource>> open(const std::string& address,
                                                  const SourceOptions& options);
  ~HttpSource() override;
  HttpSource(const HttpSource&) = delete;
  HttpSource& operator=(const HttpSource&) = delete;

  Result<std::size_t> read(std::span<std::uint8_t> out) override;
  [[nodiscard]] std::optional<std::uint64_t> size() const override { return size_; }
  [[nodiscard]] bool seekable() const override { return ranges_; }
  Status seek(std::uint64_t offset_bytes) override;
  void expect(std::uint64_t begin_bytes, std::uint64_t end_bytes) override;

  /// What went over the network: requests, redirects not counted, and bytes of bodies that arrived.
  struct Traffic {
    std::uint64_t requests = 0;
    std::uint64_t bytes = 0;
  };
  [[nodiscard]] Traffic traffic() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Retry {
    Clock::time_point until;
    std::chrono::milliseconds pause;
  };

  HttpSource(std::string address, const SourceOptions& options)
      : address_(std::move(address)), options_(options) {}

  static int poll_interrupt(void* self);
  [[nodiscard]] int interrupted();
  void arm(double timeout_s);
  Status set_headers();
  Status first_request();
  [[nodiscard]] AVDictionary* request_settings(std::uint64_t begin) const;
  Status request(std::uint64_t begin);
  [[nodiscard]] Unexpected refused(std::uint64_t begin, int code);
  Status check_answer(std::uint64_t begin);
  Status reach_position();
  Status try_again(Error failure, std::optional<Retry>& retry);
  Result<std::size_t> receive(std::span<std::uint8_t> out);
  [[nodiscard]] std::uint64_t range_end(std::uint64_t begin);
  void disconnect();
  [[nodiscard]] Unexpected failed(const std::string& doing, int code, double timeout_s);

  std::string address_;
  SourceOptions options_;
  std::string headers_;  ///< as sent

  AVIOContext* context_ = nullptr;
  std::uint64_t at_ = 0;   ///< where the connection stands
  std::uint64_t end_ = 0;  ///< of the range asked for; 0: to the end of the file
  Clock::time_point deadline_;
  bool cancelled_ = false;
  bool retryable_ = false;  ///< whether the last failure may pass

  std::uint64_t position_ = 0;  ///< where the user stands
  std::optional<std::uint64_t> size_;
  bool ranges_ = false;
  std::uint64_t expected_begin_ = 0, expected_end_ = 0;
  std::uint64_t window_end_ = 0, window_ = 0;  ///< of the last request that nothing had announced
  Traffic done_;                               ///< without the current request's bytes
};

}  // namespace relit::player
