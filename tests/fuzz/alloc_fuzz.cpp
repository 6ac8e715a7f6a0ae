// SPDX-License-Identifier: MIT
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <string>
#include <utility>

#include "container/record_codec.hpp"
#include "decoders/image.hpp"
#include "decoders/mesh.hpp"
#include "tests/fuzz/file_mutator.hpp"
#include "tests/fuzz/playing.hpp"

/// Files read without enough memory: what is done (a byte), after how many allocations all
/// others (16 bits) or one (top bit of the first byte) fail, the file. Everything reports
/// kOutOfMemory or what it found before, lets no exception out and leaks nothing.
namespace {

/// Which allocations fail: none while not armed, else all (or one) after so many.
struct Limit {
  bool armed = false;
  bool only_once = false;
  bool spent = false;
  std::uint32_t left = 0;
};
Limit limit;

bool refused() {
  if (!limit.armed || (limit.spent && limit.only_once)) return false;
  if (limit.left > 0) {
    --limit.left;
    return false;
  }
  limit.spent = true;
  return true;
}

void* allocate(std::size_t bytes) {
  return refused() ? nullptr : std::malloc(bytes + (bytes == 0));
}

void* allocate_or_throw(std::size_t bytes) {
  if (void* memory = allocate(bytes)) return memory;
  throw std::bad_alloc();
}

}  // namespace

void* operator new(std::size_t bytes) { return allocate_or_throw(bytes); }
void* operator new[](std::size_t bytes) { return allocate_or_throw(bytes); }
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept { return allocate(bytes); }
void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept { return allocate(bytes); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace {

using namespace relit;
using namespace relit::fuzz;

/// Runs one call of the library with allocations that may fail; an exception is a finding.
template <class Call>
auto limited(Call&& call) noexcept -> decltype(call()) {
  limit.armed = true;
  auto result = call();
  limit.armed = false;
  return result;
}

template <class R>
bool worked(const R& result) {
  if (!result && result.error().code == ErrorCode::kNotFound) return false;
  return check(result);
}

void play_limited(Input file, bool planes) {
  auto source = std::make_unique<container::MemorySource>(file);
  const std::string name = "fuzz";
  player::ClipOptions options;
  options.planes = planes;
  auto clip = limited([&] { return player::ClipReader::open(std::move(source), name, options); });
  if (!worked(clip)) return;
  player::ClipFrame frame;
  constexpr std::uint64_t kMostFrames = 6;
  for (std::uint64_t i = 0; i < std::min(clip->clip().frame_count, kMostFrames); ++i)
    worked(limited([&] { return clip->frame(i, frame); }));
  worked(limited([&] { return clip->frame(0, frame); }));
  worked(limited([&] { return clip->frame_at(1); }));
}

void read_limited(Input file) {
  auto source = std::make_unique<container::MemorySource>(file);
  auto reader = limited([&] { return container::Reader::open(std::move(source)); });
  if (!worked(reader)) return;
  worked(limited([&] { return container::load_static(*reader); }));
  const auto index = limited([&] { return reader->read_index(); });
  worked(limited([&] { return reader->read_copies(); }));
  for (int records = 0; records < 64; ++records) {
    const auto record = limited([&] { return reader->next(); });
    if (worked(record) && !*record) break;
    if (!record && !reader->can_continue() && !worked(limited([&] { return reader->resync(); })))
      break;
  }
  if (!worked(index) || index->segments.empty()) return;
  worked(limited([&] { return reader->seek_to_segment(index->segments.front()); }));
}

/// Pictures and meshes of the file, each decoded by itself.
void decode_limited(Input file) {
  auto reader = container::Reader::open(std::make_unique<container::MemorySource>(file));
  if (!reader) return;
  const auto contents = container::load_static(*reader);
  if (!contents) return;
  for (const auto& image : contents->images)
    worked(limited([&] { return decoders::decode_image(image.bytes, image.media_type); }));
  for (const auto& mesh : contents->meshes)
    worked(limited([&] { return decoders::decode_mesh(mesh, 65535, 65535); }));
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned seed) {
  // Mostly another place where memory ends.
  if (size > 3 && seed % 4 != 0) {
    data[1] = static_cast<std::uint8_t>(seed >> 8);
    data[2] = static_cast<std::uint8_t>((seed >> 16) & (seed >> 24) & 7);
    data[0] = static_cast<std::uint8_t>(seed >> 20);
    return size;
  }
  return mutate_file(data, size, max_size, seed, 3);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Cursor input({data, size});
  const unsigned how = input.u8();
  const std::uint32_t allocations = input.u16();
  const Input file = input.rest();
  if (!quick_to_play(file)) return 0;
  limit = {false, (how & 0x80) != 0, false, allocations};
  switch (how % 4) {
    case 0:
    case 1:
      play_limited(file, how % 4 == 0);
      break;
    case 2:
      read_limited(file);
      break;
    default:
      decode_limited(file);
  }
  return 0;
}
