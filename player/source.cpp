// SPDX-License-Identifier: MIT
#include "player/source.hpp"

#include "player/http_source.hpp"

namespace relit::player {

Result<std::unique_ptr<container::ByteSource>> open_source(const std::string& source,
                                                           const SourceOptions& options) {
  if (is_http_address(source)) {
    RELIT_ASSIGN(auto http, HttpSource::open(source, options));
    return std::unique_ptr<container::ByteSource>(std::move(http));
  }
  RELIT_ASSIGN(auto file, container::FileSource::open(source, options.interrupt));
  return std::unique_ptr<container::ByteSource>(std::move(file));
}

std::string source_name(const std::string& source) {
  return source == "-" ? "standard input" : source;
}

}  // namespace relit::player
