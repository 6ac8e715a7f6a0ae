// SPDX-License-Identifier: MIT
// container_bench FILE.relit [PAIRS]: how fast a file is parsed (framing, checksums, every field;
// payloads not decoded) over how fast its checksums alone are computed, both from memory and in
// turn; the figure is the median of the ratios. Copies of static records are in neither. Then how
// much of the file opening and seeking read.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "container/byte_source.hpp"
#include "container/reader.hpp"

using namespace relit;
using namespace relit::container;

namespace {

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

[[noreturn]] void stop(const Error& error) {
  std::fprintf(stderr, "container_bench: %s\n", error.message.c_str());
  std::exit(1);
}

std::vector<std::uint8_t> load(const char* path) {
  auto source = FileSource::open(path);
  if (!source) stop(source.error());
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>((*source)->size().value_or(0)));
  for (std::size_t at = 0; at < bytes.size();) {
    const auto got = (*source)->read(std::span(bytes).subspan(at));
    if (!got) stop(got.error());
    if (*got == 0) break;
    at += *got;
  }
  return bytes;
}

/// Memory that counts what is read.
class CountingSource final : public ByteSource {
 public:
  CountingSource(std::span<const std::uint8_t> bytes, std::uint64_t& read)
      : memory_(bytes), read_(read) {}
  Result<std::size_t> read(std::span<std::uint8_t> out) override {
    auto got = memory_.read(out);
    if (got) read_ += *got;
    return got;
  }
  [[nodiscard]] std::optional<std::uint64_t> size() const override { return memory_.size(); }
  [[nodiscard]] bool seekable() const override { return true; }
  Status seek(std::uint64_t offset) override { return memory_.seek(offset); }

 private:
  MemorySource memory_;
  std::uint64_t& read_;
};

// Every record, its payload's checksum, every field.
std::uint64_t parse(std::span<const std::uint8_t> bytes) {
  auto reader = Reader::open(std::make_unique<MemorySource>(bytes));
  if (!reader) stop(reader.error());
  std::uint64_t records = 1;
  for (;; ++records) {
    const auto record = reader->next();
    if (!record) stop(record.error());
    if (!*record) return records;
  }
}

// The payloads that a reader checks: it passes over copies.
std::vector<std::span<const std::uint8_t>> checked_payloads(std::span<const std::uint8_t> bytes) {
  std::vector<std::span<const std::uint8_t>> payloads;
  for (std::size_t at = kSignature.size(); at + kRecordHeaderBytes <= bytes.size();) {
    const auto header = decode_header(bytes.subspan(at).first<kRecordHeaderBytes>());
    if (!header) stop(header.error());
    const auto size = static_cast<std::size_t>(header->payload_bytes);
    if ((header->flags & flags::kCopy) == 0)
      payloads.push_back(bytes.subspan(at + kRecordHeaderBytes, size));
    at += static_cast<std::size_t>(record_bytes(size));
  }
  return payloads;
}

void bench_parsing(std::span<const std::uint8_t> bytes, int pairs) {
  const auto payloads = checked_payloads(bytes);
  // Small files are parsed several times, so that one timing is some tens of milliseconds.
  const auto rounds = std::max<std::size_t>(1, (std::size_t{32} << 20) / bytes.size());
  std::vector<double> ratios;
  std::uint64_t records = 0;
  std::uint32_t sum = 0;
  for (int i = 0; i < pairs; ++i) {
    const double start = now_s();
    for (std::size_t r = 0; r < rounds; ++r)
      for (const auto payload : payloads) sum += crc32(payload);
    const double between = now_s();
    for (std::size_t r = 0; r < rounds; ++r) records = parse(bytes);
    ratios.push_back((between - start) / (now_s() - between));
  }
  std::ranges::sort(ratios);
  std::printf(
      "parsing over checksum alone: median %.2f (%.2f to %.2f, %d pairs), %llu records "
      "(checksums %08x)\n",
      ratios[ratios.size() / 2], ratios.front(), ratios.back(), pairs,
      static_cast<unsigned long long>(records), sum);
}

void count_reads(std::span<const std::uint8_t> bytes) {
  std::uint64_t read = 0;
  auto reader = Reader::open(std::make_unique<CountingSource>(bytes, read));
  if (!reader) stop(reader.error());
  std::printf("opening: %llu of %zu bytes read", static_cast<unsigned long long>(read),
              bytes.size());
  const auto contents = load_static(*reader);
  if (!contents) stop(contents.error());
  std::printf("; with the static part %llu\n", static_cast<unsigned long long>(read));
  read = 0;
  const auto index = reader->read_index();
  if (!index || index->segments.empty()) return;
  std::printf("index of %zu segments: %llu bytes read", index->segments.size(),
              static_cast<unsigned long long>(read));
  read = 0;
  if (const auto status = reader->seek_to_segment(index->segments.back()); !status)
    stop(status.error());
  if (const auto record = reader->next(); !record) stop(record.error());
  std::printf("; seeking to the last one: %llu\n", static_cast<unsigned long long>(read));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: container_bench FILE.relit [PAIRS]\n");
    return 2;
  }
  const auto bytes = load(argv[1]);
  if (bytes.empty()) return 1;
  bench_parsing(bytes, argc > 2 ? std::max(1, std::atoi(argv[2])) : 21);
  count_reads(bytes);
  return 0;
}
