// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <span>

#include "container/base/result.hpp"
#include "container/byte_source.hpp"

namespace relit::player {

/// One seekable source for several readers, each at a place of its own: so two clips of a file can
/// play at once. Reads take turns; one that blocks holds up the others. A path or an address can as
/// well be opened twice, which over HTTP saves the new request that each change of turns costs. Any
/// thread.
class SharedSource : public std::enable_shared_from_this<SharedSource> {
 public:
  /// Errors: kUnsupported for a source that cannot seek.
  static Result<std::shared_ptr<SharedSource>> create(
      std::unique_ptr<container::ByteSource> source);

  /// A reader's source, at the file's beginning; keeps the shared one alive. Each is used by one
  /// thread at a time, different ones by different threads.
  [[nodiscard]] std::unique_ptr<container::ByteSource> cursor();

 private:
  class Cursor;

  explicit SharedSource(std::unique_ptr<container::ByteSource> source)
      : source_(std::move(source)) {}

  Result<std::size_t> read_at(const Cursor& cursor, std::uint64_t position,
                              std::span<std::uint8_t> out);

  std::mutex mutex_;
  std::unique_ptr<container::ByteSource> source_;
  std::optional<std::uint64_t> position_;  ///< of source_, where that is known
  const Cursor* expects_ = nullptr;        ///< whose expect() the source heard last
};

}  // namespace relit::player
