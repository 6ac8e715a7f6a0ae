// SPDX-License-Identifier: MIT
#include "tests/fuzz/file_mutator.hpp"

#include <zstd.h>

#include <random>
#include <utility>

#include "container/record_codec.hpp"
#include "tests/fuzz/file_parts.hpp"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace relit::fuzz {
namespace {

using namespace relit::container;
using Random = std::mt19937;

std::size_t below(Random& random, std::size_t limit) { return random() % limit; }

/// LLVMFuzzerMutate on a vector that may grow by a little.
void mutate_bytes(Bytes& bytes) {
  constexpr std::size_t kGrowth = 64;
  const std::size_t size = bytes.size();
  bytes.resize(size + kGrowth);
  bytes.resize(LLVMFuzzerMutate(bytes.data(), size, bytes.size()));
}

/// Changes what a zstd frame holds; false where `bytes` is none of a reasonable size.
bool mutate_frame(Bytes& bytes) {
  constexpr unsigned long long kMostBytes = 1 << 16;
  const auto size = ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  if (size > kMostBytes) return false;  // the two error values are the greatest
  Bytes plain(static_cast<std::size_t>(size));
  if (ZSTD_isError(ZSTD_decompress(plain.data(), plain.size(), bytes.data(), bytes.size())))
    return false;
  mutate_bytes(plain);
  Bytes coded(ZSTD_compressBound(plain.size()));
  coded.resize(ZSTD_compress(coded.data(), coded.size(), plain.data(), plain.size(), 1));
  bytes = std::move(coded);
  return true;
}

bool mutate_mesh(Bytes& payload, Random& random) {
  auto mesh = parse_mesh(payload);
  if (!mesh) return false;
  std::vector<Bytes*> frames{&mesh->indices};
  for (auto& stream : mesh->streams) frames.push_back(&stream.bytes);
  for (auto& target : mesh->morph_targets) frames.push_back(&target.bytes);
  if (!mutate_frame(*frames[below(random, frames.size())])) return false;
  payload = serialize(*mesh);
  return true;
}

/// Changes one packet and leaves the others where they are.
bool mutate_chunk(Bytes& payload, Random& random) {
  auto chunk = parse_chunk(payload);
  if (!chunk || chunk->packets.empty()) return false;
  const std::size_t chosen = below(random, chunk->packets.size());
  Bytes data;
  for (std::size_t i = 0; i < chunk->packets.size(); ++i) {
    Packet& packet = chunk->packets[i];
    Bytes bytes = copy(Input(chunk->data).subspan(packet.offset, packet.size));
    if (i == chosen && !mutate_frame(bytes)) mutate_bytes(bytes);
    packet.offset = data.size();
    packet.size = bytes.size();
    data.insert(data.end(), bytes.begin(), bytes.end());
  }
  chunk->data = std::move(data);
  payload = serialize(*chunk);
  return true;
}

void mutate_part(Part& part, Random& random) {
  const bool inside = below(random, 2) == 0;
  if (inside && part.type == types::kMesh && mutate_mesh(part.payload, random)) return;
  if (inside && part.type == types::kChunk && mutate_chunk(part.payload, random)) return;
  mutate_bytes(part.payload);
}

void mutate_parts(std::vector<Part>& parts, Random& random) {
  const std::size_t at = below(random, parts.size()), other = below(random, parts.size());
  switch (below(random, 16)) {
    case 0:
      parts.erase(parts.begin() + static_cast<std::ptrdiff_t>(at));
      break;
    case 1:
      parts.insert(parts.begin() + static_cast<std::ptrdiff_t>(at), Part(parts[other]));
      break;
    case 2:
      std::swap(parts[at], parts[other]);
      break;
    case 3:
      parts[at].flags ^= 1u << below(random, 32);
      break;
    default:
      mutate_part(parts[at], random);
  }
}

}  // namespace

std::size_t mutate_file(std::uint8_t* data, std::size_t size, std::size_t max_size,
                        std::uint32_t seed, std::size_t prefix) {
  Random random(seed);
  const auto plain = [&] { return LLVMFuzzerMutate(data, size, max_size); };
  if (size <= prefix || below(random, 5) == 0) return plain();
  std::vector<Part> parts = split(Input(data, size).subspan(prefix));
  if (parts.empty()) return plain();
  mutate_parts(parts, random);
  const Bytes file = join(std::move(parts));
  if (prefix + file.size() > max_size) return plain();
  std::ranges::copy(file, data + prefix);
  return prefix + file.size();
}

}  // namespace relit::fuzz
