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

class Pipe final : public ByteSource {
 public:
  explicit Pipe(Input bytes) : bytes_(bytes) {}
  Result<std::size_t> read(std::span<std::uint8_t> out) override {
    const Input piece = bytes_.take(std::min<std::size_t>(out.size(), 97));
    std::ranges::copy(piece, out.begin());
    return piece.size();
  }

 private:
  Cursor bytes_;
};

void read_to_the_end(Reader& reader) {
  // Each step consumes bytes of the input, except that an error may be met twice.
  for (;;) {
    auto record = reader.next();
    if (record && !*record) return;
    if (check(record)) continue;
    if (reader.can_continue()) continue;
    const auto found = reader.resync();
    if (!check(found) || !*found) return;
  }
}

void read_by_index(Reader& reader, const IndexRecord& index) {
  constexpr std::size_t kMost = 4;
  for (std::size_t i = 0; i < std::min(index.segments.size(), kMost); ++i) {
    if (!check(reader.seek_to_segment(index.segments[i]))) continue;
    read_to_the_end(reader);
  }
}

void read_file(Input file, unsigned how) {
  std::unique_ptr<ByteSource> source;
  if ((how & 1) != 0)
    source = std::make_unique<Pipe>(file);
  else
    source = std::make_unique<MemorySource>(file);
  ReaderOptions options;
  options.verify_checksums = (how & 4) == 0;
  auto reader = Reader::open(std::move(source), options);
  if (!check(reader)) return;
  if ((how & 2) != 0) reader->set_wanted_tracks({{2, 4}});
  const auto contents = load_static(*reader);
  if (check(contents)) require(!contents->clips.empty());
  const auto index = reader->read_index();
  if ((how & 8) != 0) reader->skip_segment();
  read_to_the_end(*reader);
  check(reader->read_copies());
  if (check(index)) read_by_index(*reader, *index);
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
