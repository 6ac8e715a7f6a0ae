// SPDX-License-Identifier: MIT
#include "decoders/inflate.hpp"

#include <zstd.h>

#include <string>

namespace relit::decoders {
namespace {

Result<std::size_t> stated_size(std::span<const std::uint8_t> bytes, std::string_view what) {
  const unsigned long long size = ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  if (size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN) {
    return fail(ErrorCode::kCorrupt,
                std::string(what) + ": not a zstd frame that states its content size");
  }
  // Skippable frames and further frames would hide bytes that no reader looks at.
  const std::size_t frame = ZSTD_findFrameCompressedSize(bytes.data(), bytes.size());
  if (ZSTD_isError(frame) || frame != bytes.size()) {
    return fail(ErrorCode::kCorrupt, std::string(what) +
                                         ": the zstd frame does not end where its " +
                                         std::to_string(bytes.size()) + " bytes do");
  }
  return static_cast<std::size_t>(size);
}

Status decompress(std::span<const std::uint8_t> bytes, std::size_t size, std::string_view what,
                  std::vector<std::uint8_t>& out) {
  out.resize(size);
  const std::size_t written = ZSTD_decompress(out.data(), out.size(), bytes.data(), bytes.size());
  if (ZSTD_isError(written) || written != size) {
    return fail(ErrorCode::kCorrupt,
                std::string(what) + ": zstd data damaged" +
                    (ZSTD_isError(written) ? std::string(": ") + ZSTD_getErrorName(written) : ""));
  }
  return {};
}

}  // namespace

Result<std::vector<std::uint8_t>> inflate(std::span<const std::uint8_t> bytes,
                                          std::size_t max_bytes, std::string_view what) {
  RELIT_ASSIGN(const std::size_t size, stated_size(bytes, what));
  if (size > max_bytes) {
    return fail(ErrorCode::kLimit, std::string(what) + ": decompresses to " + std::to_string(size) +
                                       " bytes, at most " + std::to_string(max_bytes) +
                                       " are allowed");
  }
  std::vector<std::uint8_t> out;
  RELIT_TRY(decompress(bytes, size, what, out));
  return out;
}

Result<std::vector<std::uint8_t>> inflate_exact(std::span<const std::uint8_t> bytes,
                                                std::size_t exact_bytes, std::string_view what) {
  std::vector<std::uint8_t> out;
  RELIT_TRY(inflate_exact_into(bytes, exact_bytes, what, out));
  return out;
}

Status inflate_exact_into(std::span<const std::uint8_t> bytes, std::size_t exact_bytes,
                          std::string_view what, std::vector<std::uint8_t>& out) {
  RELIT_ASSIGN(const std::size_t size, stated_size(bytes, what));
  if (size != exact_bytes) {
    return fail(ErrorCode::kCorrupt, std::string(what) + ": decompresses to " +
                                         std::to_string(size) + " bytes instead of " +
                                         std::to_string(exact_bytes));
  }
  return decompress(bytes, size, what, out);
}

}  // namespace relit::decoders
