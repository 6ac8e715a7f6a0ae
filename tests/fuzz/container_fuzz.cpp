// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "container/reader.hpp"
#include "container/record_codec.hpp"

/// Reads hostile bytes: as a file, from a source that seeks and from one that does not, and as the
/// payload of each record. The first byte says which, the rest are the bytes. What is accepted must
/// be written back as it was, and no error may come without a code and a message.
namespace {

using namespace relit;
using namespace relit::container;

using Input = std::span<const std::uint8_t>;

void require(bool condition) {
  if (!condition) std::abort();
}

void check(const Error& error) {
  require(!error.message.empty());
  require(error.code != ErrorCode::kInvalid && error.code != ErrorCode::kIo);
}

template <class R>
void round_trip(const Result<R>& parsed, Input input) {
  if (!parsed) return check(parsed.error());
  require(std::ranges::equal(serialize(*parsed), input));
}

class Pipe final : public ByteSource {
 public:
  explicit Pipe(std::vector<std::uint8_t> bytes) : bytes_(std::move(bytes)) {}
  Result<std::size_t> read(std::span<std::uint8_t> out) override {
    const std::size_t n = std::min({out.size(), std::size_t{97}, bytes_.size() - position_});
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(position_), n, out.begin());
    position_ += n;
    return n;
  }

 private:
  std::vector<std::uint8_t> bytes_;
  std::size_t position_ = 0;
};

void read_to_the_end(Reader& reader) {
  // Each step consumes bytes of the input, except that an error may be met twice.
  for (;;) {
    auto record = reader.next();
    if (record && !*record) return;
    if (record) continue;
    check(record.error());
    if (reader.can_continue()) continue;
    auto found = reader.resync();
    if (!found || !*found) return;
  }
}

void read_file(Input input, bool pipe, bool skip_some, bool verify) {
  std::vector<std::uint8_t> bytes(kSignature.begin(), kSignature.end());
  bytes.insert(bytes.end(), input.begin(), input.end());
  std::unique_ptr<ByteSource> source;
  if (pipe)
    source = std::make_unique<Pipe>(std::move(bytes));
  else
    source = std::make_unique<MemorySource>(std::move(bytes));
  ReaderOptions options;
  options.verify_checksums = verify;
  auto reader = Reader::open(std::move(source), options);
  if (!reader) return check(reader.error());
  if (skip_some) reader->set_wanted_tracks({{2, 4}});
  const auto contents = load_static(*reader);
  if (!contents) check(contents.error());
  auto index = reader->read_index();
  read_to_the_end(*reader);
  if (!index) return;
  for (std::size_t i = 0; i < std::min<std::size_t>(index->segments.size(), 4); ++i)
    if (reader->seek_to_segment(index->segments[i])) read_to_the_end(*reader);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const Input input(data + 1, size - 1);
  switch (data[0]) {
    case 'h':
      round_trip(parse_header(input), input);
      break;
    case 'c':
      round_trip(parse_clip(input), input);
      break;
    case 'i':
      round_trip(parse_image(input), input);
      break;
    case 'm':
      round_trip(parse_material(input), input);
      break;
    case 'g':
      round_trip(parse_mesh(input), input);
      break;
    case 's':
      round_trip(parse_skeleton(input), input);
      break;
    case 'p':
      round_trip(parse_pose_track(input), input);
      break;
    case 'a':
      round_trip(parse_model(input), input);
      break;
    case 'l':
      round_trip(parse_layer(input), input);
      break;
    case 'S':
      round_trip(parse_segment(input), input);
      break;
    case 'C':
      round_trip(parse_chunk(input), input);
      break;
    case 'I':
      round_trip(parse_index(input), input);
      break;
    case 'E':
      round_trip(parse_end(input), input);
      break;
    default:
      read_file(input, (data[0] & 1) != 0, (data[0] & 2) != 0, (data[0] & 4) != 0);
  }
  return 0;
}
