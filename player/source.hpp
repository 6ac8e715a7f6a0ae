// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "container/byte_source.hpp"

namespace relit::player {

/// How to read what the user named. All but `interrupt` and `warn` concern http(s) alone.
struct SourceOptions {
  std::vector<std::string> http_headers;  ///< "Name: value", sent with every request
  /// Fetches only what ByteSource::expect() announces, in requests that have an end; false: one
  /// request to the end of the file, which is best where everything will be read.
  bool sparing = false;
  /// From asking until the answer's header is there, redirects and encryption included. Looking up
  /// the name is the system's and has its own limits.
  double connect_timeout_s = 10;
  double read_timeout_s = 10;  ///< without a single byte
  /// How long a broken connection is taken up again without a byte coming; 0: not at all.
  double retry_s = 20;
  /// Polled at least every 100 ms while waiting for a server or a pipe, from the thread that reads;
  /// true: stop with kCancelled.
  std::function<bool()> interrupt;
  std::function<void(const std::string&)> warn;  ///< takes a sentence for the user
};

/// Opens what a user names: a path, "-" for standard input, or an http(s):// address (HttpSource).
/// Errors: kIo with the reason; kInvalid for headers that are none; kCancelled; kEnvironment where
/// this FFmpeg cannot do the protocol.
[[nodiscard]] Result<std::unique_ptr<container::ByteSource>> open_source(
    const std::string& source, const SourceOptions& options = {});

/// What messages call it: "standard input" for "-".
[[nodiscard]] std::string source_name(const std::string& source);

}  // namespace relit::player
