// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "container/base/result.hpp"
#include "container/reader.hpp"
#include "container/writer.hpp"

/// What recover, remux and concat share: records go from file to file as they are, and nothing is
/// ever encoded again.
namespace relit::player {

/// Writes all static records but the header in the order of the file. Errors: the writer's.
[[nodiscard]] Status write_static(container::Writer& writer,
                                  const container::FileContents& contents);

/// Removes a clip and all that belongs to it.
void drop_clip(container::FileContents& contents, std::uint32_t clip_id);

/// Whether a record of a type that this version does not know may be carried over into a changed
/// file (FORMAT.md, 2.3).
[[nodiscard]] bool may_be_copied(container::RecordType type);

/// A segment with all of its chunks that are wanted.
struct WholeSegment {
  container::SegmentRecord segment;
  std::vector<container::ChunkRecord> chunks;
};

/// A record of unknown type.
struct UnknownRecord {
  container::RecordType type{};
  std::vector<std::uint8_t> payload;
};

/// Writes the records where the writer stands. Errors: the writer's.
[[nodiscard]] Status write_unknown(container::Writer& writer,
                                   const std::vector<UnknownRecord>& records);

/// A file that is to be written anew: its static part, then segment by segment. Reads forward only
/// and refuses damage: what is lost should be lost by `recover`, knowingly. One thread at a time.
class RewriteSource {
 public:
  /// Reads everything static. `name` is for messages. Errors: those of the reader; kCorrupt for
  /// damage, naming `relit recover`.
  static Result<RewriteSource> open(std::unique_ptr<container::ByteSource> source,
                                    std::string name);

  [[nodiscard]] const container::FileContents& contents() const { return contents_; }
  [[nodiscard]] const std::string& name() const { return name_; }

  /// From the next segment on, chunks of other tracks are left out, unread.
  void set_wanted_tracks(std::vector<std::uint32_t> tracks);
  /// The next segment; nothing behind the last one. Errors: as open(); kTruncated for a file
  /// without its end.
  Result<std::optional<WholeSegment>> next();
  /// The index at the end of the source. Errors: as Reader::read_index().
  Result<container::IndexRecord> read_index() { return reader_.read_index(); }
  /// Unknown records that may be copied and have gone by since the last call.
  std::vector<UnknownRecord> take_unknown() { return std::exchange(*unknown_, {}); }

 private:
  RewriteSource(container::Reader reader, std::string name,
                std::shared_ptr<std::vector<UnknownRecord>> unknown)
      : reader_(std::move(reader)), name_(std::move(name)), unknown_(std::move(unknown)) {}
  [[nodiscard]] Unexpected in_file(const Error& error) const;

  container::Reader reader_;
  std::string name_;
  std::shared_ptr<std::vector<UnknownRecord>> unknown_;  ///< shared with the reader's callback
  container::FileContents contents_;
  std::optional<container::SegmentRecord> ahead_;  ///< read while looking for the end of the last
  bool ended_ = false;
};

/// Opens what a user names, as open_source() does. Errors: its own, and RewriteSource::open()'s.
Result<RewriteSource> open_rewrite(const std::string& name);

}  // namespace relit::player
