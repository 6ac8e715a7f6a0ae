// SPDX-License-Identifier: MIT
// What a sparing Reader tells its source beforehand (ReaderOptions::sparing).
#include <algorithm>

#include "container/reader.hpp"

namespace relit::container {

bool Reader::is_wanted(std::uint32_t track_id) const {
  return !wanted_ || std::ranges::binary_search(*wanted_, track_id);
}

/// How many bytes from the next chunk on are wanted with no gap worth a request of its own. Ends
/// with the segment: whether the next one is wanted is not known yet.
std::uint64_t Reader::wanted_run() const {
  std::uint64_t end = 0, at = 0;
  for (std::size_t i = chunk_; i < segment_->chunks.size(); ++i) {
    const auto& chunk = segment_->chunks[i];
    at += chunk.chunk_bytes;
    if (is_wanted(chunk.track_id))
      end = at;
    else if (at - end >= RecordInput::kLeastSeekBytes)
      break;
  }
  return end;
}

/// What will be read from `begin` on, which nothing but copies, index and end follows.
std::uint64_t Reader::behind_segments(std::uint64_t begin) const {
  if (begin < segments_end_) return segments_end_;
  const bool passes_copies =
      begin == end_->copies_offset && end_->index_offset > begin + RecordInput::kLeastSeekBytes;
  return passes_copies ? begin + kRecordHeaderBytes : end_->file_bytes;
}

/// Tells the source what is wanted from the next record on.
void Reader::announce() {
  if (!options_.sparing) return;
  const std::uint64_t begin = input_.offset_bytes();
  // The first chunk of a segment shows how good the guess was.
  if (begin < announced_end_ && !(segment_ && chunk_ == 0)) return;
  if (segment_) {
    announced_end_ = begin + wanted_run();
  } else if (begin < static_end_) {
    announced_end_ = static_end_ + segment_guess_;
  } else if (order_ == order_of(types::kSegment)) {
    announced_end_ = begin + segment_guess_;
  } else {
    return;  // nothing is known, and the source finds its own steps
  }
  if (end_ && announced_end_ > segments_end_) announced_end_ = behind_segments(begin);
  input_.expect(begin, announced_end_);
}

/// Between the last segment and the index there are copies alone.
void Reader::pass_copies(std::uint64_t offset) {
  if (!end_ || offset != end_->copies_offset) return;
  const std::uint64_t next = input_.offset_bytes();
  if (next < end_->index_offset) input_.skip_bytes(end_->index_offset - next);
}

}  // namespace relit::container
