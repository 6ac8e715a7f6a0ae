// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>

#include "container/reader.hpp"
#include "tests/fuzz/file_mutator.hpp"
#include "tests/fuzz/fuzz.hpp"

/// Hostile files, from a source that seeks and from one that does not: static part, index, copies,
/// every segment, every way around damage. The first byte says how, the rest is the file.
namespace {

using namespace relit;
using namespace relit::container;
using namespace relit::fuzz;

/// A host's source in small pieces, which goes back or only forward, and may end with an error.
struct Host {
  Input bytes;
  std::size_t at = 0;
  bool fails = false;
};

std::int64_t host_read(void* user, std::uint8_t* out, std::size_t bytes) {
  constexpr std::size_t kPiece = 97;
  Host& host = *static_cast<Host*>(user);
  if (host.fails && host.at == host.bytes.size()) return -static_cast<int>(ErrorCode::kTruncated);
  const Input piece =
      host.bytes.subspan(host.at, std::min({bytes, kPiece, host.bytes.size() - host.at}));
  std::ranges::copy(piece, out);
  host.at += piece.size();
  return static_cast<std::int64_t>(piece.size());
}

int host_seek(void* user, std::uint64_t offset) {
  Host& host = *static_cast<Host*>(user);
  host.at = static_cast<std::size_t>(std::min<std::uint64_t>(offset, host.bytes.size()));
  return 0;
}

std::int64_t host_size(void* user) {
  return static_cast<std::int64_t>(static_cast<Host*>(user)->bytes.size());
}

/// What was read, given back for what comes.
void recycle(Reader& reader, Record& record) {
  if (auto* segment = std::get_if<SegmentRecord>(&record.body)) reader.recycle(std::move(*segment));
  if (auto* chunk = std::get_if<ChunkRecord>(&record.body)) reader.recycle(std::move(*chunk));
  require(reader.spare_bytes() < std::size_t{1} << 32);
}

void read_to_the_end(Reader& reader, bool recycling) {
  // Each step consumes bytes of the input, except that an error may be met twice.
  for (;;) {
    auto record = reader.next();
    if (record && !*record) return;
    if (record && recycling) recycle(reader, **record);
    if (check(record)) continue;
    if (reader.can_continue()) continue;
    const auto found = reader.resync();
    if (!check(found) || !*found) return;
  }
}

void read_by_index(Reader& reader, const IndexRecord& index, bool recycling) {
  constexpr std::size_t kMost = 4;
  for (std::size_t i = 0; i < std::min(index.segments.size(), kMost); ++i) {
    if (!check(reader.seek_to_segment(index.segments[i]))) continue;
    read_to_the_end(reader, recycling);
  }
}

void read_file(Input file, unsigned how) {
  Host host{file, 0, (how & 32) != 0};
  std::unique_ptr<ByteSource> source = std::make_unique<MemorySource>(file);
  const bool forward = (how & 1) != 0;
  if (forward || host.fails) {
    SourceCallbacks calls{&host, host_read, nullptr, nullptr, nullptr, nullptr};
    if (!forward) calls.seek = host_seek, calls.size = host_size;
    source = std::move(*CallbackSource::open(calls));
  }
  ReaderOptions options;
  options.verify_checksums = (how & 4) == 0;
  auto reader = Reader::open(std::move(source), options);
  if (!check(reader)) return;
  if ((how & 2) != 0) reader->set_wanted_tracks({{2, 4}});
  const auto contents = load_static(*reader);
  if (check(contents)) require(!contents->clips.empty());
  const auto index = reader->read_index();
  if ((how & 8) != 0) reader->skip_segment();
  const bool recycling = (how & 16) != 0;
  read_to_the_end(*reader, recycling);
  check(reader->read_copies());
  if (check(index)) read_by_index(*reader, *index, recycling);
  const ReaderLoss loss = reader->loss();
  // What was lost comes from the file, or was gone over again within the reader's own limit.
  require(loss.missing_segments <= UINT32_MAX * std::uint64_t{1 + file.size()});
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned seed) {
  return mutate_file(data, size, max_size, seed, 1);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 0) read_file(Input(data + 1, size - 1), data[0]);
  return 0;
}
