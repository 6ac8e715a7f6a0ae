// SPDX-License-Identifier: MIT
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "container/framing.hpp"
#include "container/record_codec.hpp"
#include "player/clip_reader.hpp"
#include "tests/player/coded_file.hpp"
#include "tests/player/files.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::player;
using namespace relit::player::test;

/// Files that somebody or something has changed: each gives an error that says so, or plays as far
/// as it is whole.
namespace {

using Bytes = std::vector<std::uint8_t>;

// A sanitizer keeps what was freed, and its own books: there memory says nothing of relit's.
#if defined(__SANITIZE_ADDRESS__)
constexpr bool kMemoryCounts = false;
#elif defined(__has_feature)
constexpr bool kMemoryCounts = !__has_feature(address_sanitizer);
#else
constexpr bool kMemoryCounts = true;
#endif

/// Most that the process has ever held, in bytes.
std::uint64_t peak_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

bool is_finite(const decoders::Pose& pose) {
  for (const auto& m : pose.palette)
    for (int c = 0; c < 4; ++c)
      for (int r = 0; r < 3; ++r)
        if (!std::isfinite(m[c][r])) return false;
  return true;
}

std::size_t planes_of(const ClipReader& clip) {
  std::size_t planes = 0;
  for (const auto& layer : clip.layers()) planes += layer.planes.size();
  return planes;
}

struct Outcome {
  bool opened = false;
  int frames = 0;  ///< that could be shown
  std::string message;
};

void refuse(Outcome& outcome, const Error& error) {
  if (error.message.empty() || error.code == ErrorCode::kInvalid || error.code == ErrorCode::kIo)
    throw std::runtime_error("an error without a reason, or with a wrong one: " + error.message);
  outcome.message = error.message;
}

/// Opens the file, decodes its first frames; throws where an error or a frame breaks a promise.
Outcome play(std::unique_ptr<container::ByteSource> source) {
  constexpr std::uint64_t kMostFrames = 8;
  Outcome outcome;
  auto clip = ClipReader::open(std::move(source), "changed", {});
  if (!clip) {
    refuse(outcome, clip.error());
    return outcome;
  }
  outcome.opened = true;
  ClipFrame frame;
  for (std::uint64_t i = 0; i < std::min(clip->clip().frame_count, kMostFrames); ++i) {
    const Status status = clip->frame(i, frame);
    if (!status) refuse(outcome, status.error());
    if (!status) continue;
    ++outcome.frames;
    const bool sizes = frame.planes.planes().size() == planes_of(*clip) &&
                       frame.pose.palette.size() == clip->contents().skeleton.palette.size();
    if (!sizes || !is_finite(frame.pose)) throw std::runtime_error("a frame of wrong numbers");
  }
  return outcome;
}

Outcome play(Bytes bytes) {
  return play(std::make_unique<container::MemorySource>(std::move(bytes)));
}

/// Changes one byte, or one bit, anywhere.
void change(Bytes& file, std::mt19937& random) {
  std::uint8_t& byte = file[random() % file.size()];
  if (random() % 2 == 0)
    byte = static_cast<std::uint8_t>(random());
  else
    byte ^= static_cast<std::uint8_t>(1u << random() % 8);
}

struct Record {
  std::size_t offset = 0;
  container::RecordHeader header;
};

std::vector<Record> records(const Bytes& file) {
  std::vector<Record> found;
  for (std::size_t at = container::kSignature.size(); at < file.size();) {
    const auto bytes = std::span(file).subspan(at).first<container::kRecordHeaderBytes>();
    const auto header = container::decode_header(bytes);
    REQUIRE(header);
    found.push_back({at, *header});
    at += static_cast<std::size_t>(container::record_bytes(header->payload_bytes));
  }
  return found;
}

/// Makes the checksums of all records right again, so that the change is met behind them.
void mend(Bytes& file, const std::vector<Record>& original) {
  for (const Record& record : original) {
    container::RecordHeader header = record.header;
    const auto payload =
        std::span(file).subspan(record.offset + container::kRecordHeaderBytes,
                                static_cast<std::size_t>(record.header.payload_bytes));
    header.payload_crc = container::crc32(payload);
    std::ranges::copy(container::encode_header(header),
                      file.begin() + static_cast<std::ptrdiff_t>(record.offset));
  }
}

}  // namespace

TEST_CASE("the small file plays whole") {
  for (const char* codec : {"ffv1", "mpeg4"}) {
    for (const bool exponents : {false, true}) {
      INFO(codec << (exponents ? " with exponents" : ""));
      const Outcome whole = play(coded_file({codec, exponents, true, exponents}));
      CHECK(whole.message.empty());
      CHECK(whole.frames == static_cast<int>(kCodedFrames));
    }
  }
}

TEST_CASE("twenty thousand changed files are refused or play", "[long]") {
  std::mt19937 random(20);
  const std::vector<Bytes> files{coded_file({"ffv1", true, false, false}),
                                 coded_file({"ffv1", false, true, true}),
                                 coded_file({"mpeg4", false, true, false})};
  std::vector<std::vector<Record>> structures;
  for (const Bytes& file : files) structures.push_back(records(file));
  play(files[0]);  // so that what is allocated once does not count
  const std::uint64_t before = peak_bytes();
  int opened = 0, refused = 0;
  for (int i = 0; i < 20000; ++i) {
    const std::size_t which = static_cast<std::size_t>(i) % files.size();
    Bytes file = files[which];
    const unsigned changes = 1 + random() % 8;
    for (unsigned k = 0; k < changes; ++k) change(file, random);
    // Every other file gets past the checksums.
    if (i % 2 == 0) mend(file, structures[which]);
    const Outcome outcome = play(std::move(file));
    ++(outcome.opened ? opened : refused);
  }
  CHECK(opened > 1000);
  CHECK(refused > 1000);
  CHECK((!kMemoryCounts || peak_bytes() - before < 256u << 20));
}

TEST_CASE("every truncation is refused or plays what is left") {
  const Bytes file = coded_file({"ffv1", true, true, false});
  int frames = 0;
  for (std::size_t size = 0; size < file.size(); ++size) {
    INFO(size);
    const Outcome outcome = play(Bytes(file.begin(), file.begin() + static_cast<int>(size)));
    // What has been cut off is at the end, so a longer piece never plays less.
    CHECK(outcome.frames >= frames);
    frames = std::max(frames, outcome.frames);
    if (!outcome.opened) CHECK_FALSE(outcome.message.empty());
  }
  CHECK(frames == static_cast<int>(kCodedFrames));
}

TEST_CASE("absurd lengths are refused before anything is allocated") {
  const Bytes file = coded_file({});
  const std::uint64_t before = peak_bytes();
  for (const Record& record : records(file)) {
    for (const std::uint64_t bytes :
         {std::uint64_t{1} << 63, ~std::uint64_t{0}, ~std::uint64_t{0} - 23, std::uint64_t{1} << 40,
          limits::kRecordBytes, limits::kRecordBytes + 1}) {
      INFO(record.offset << " " << bytes);
      Bytes changed = file;
      container::RecordHeader header = record.header;
      header.payload_bytes = bytes;
      std::ranges::copy(container::encode_header(header),
                        changed.begin() + static_cast<std::ptrdiff_t>(record.offset));
      const Outcome outcome = play(std::move(changed));
      CHECK((outcome.opened || !outcome.message.empty()));
    }
  }
  CHECK((!kMemoryCounts || peak_bytes() - before < 64u << 20));
}

TEST_CASE("a count of 10^9 in place of any number of a record is refused") {
  const Bytes file = coded_file({});
  const auto structure = records(file);
  const std::uint64_t before = peak_bytes();
  for (const Record& record : structure) {
    const std::size_t begin = record.offset + container::kRecordHeaderBytes;
    for (std::size_t at = 0; at + 4 <= record.header.payload_bytes; ++at) {
      INFO(container::type_name(record.header.type) << " at byte " << at);
      Bytes changed = file;
      for (std::size_t i = 0; i < 4; ++i)
        changed[begin + at + i] = static_cast<std::uint8_t>(1'000'000'000u >> (8 * i));
      mend(changed, structure);
      const Outcome outcome = play(std::move(changed));
      CHECK((outcome.opened || !outcome.message.empty()));
    }
  }
  CHECK((!kMemoryCounts || peak_bytes() - before < 256u << 20));
}

TEST_CASE("a sparse file of 10 GB is refused or read without holding it") {
  const Folder folder;
  const std::string path = folder.file("huge.relit");
  const Bytes file = coded_file({});
  constexpr std::uintmax_t kHuge = 10'000'000'000;
  const std::uint64_t before = peak_bytes();
  const auto open = [&](const Bytes& content) {
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(content.data()),
               static_cast<std::streamsize>(content.size()));
    std::filesystem::resize_file(path, kHuge);
    auto source = container::FileSource::open(path);
    REQUIRE(source);
    return ClipReader::open(std::move(*source), "huge", {});
  };
  SECTION("zeros") {
    const auto clip = open({});
    REQUIRE_FALSE(clip);
    CHECK(clip.error().code == ErrorCode::kCorrupt);
  }
  SECTION("a whole file, then zeros") {
    auto clip = open(file);
    REQUIRE(clip);
    ClipFrame frame;
    for (std::uint64_t i = 0; i < kCodedFrames; ++i) CHECK(clip->frame(i, frame));
  }
  SECTION("a record of a gigabyte where the first segment should be") {
    const auto structure = records(file);
    const auto segment = std::ranges::find(structure, container::types::kSegment,
                                           [](const Record& r) { return r.header.type; });
    Bytes head(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(segment->offset));
    const auto header =
        container::encode_header({container::record_type("xxXx"), 0, limits::kRecordBytes, 0});
    head.insert(head.end(), header.begin(), header.end());
    auto clip = open(head);
    if (!clip) CHECK_FALSE(clip.error().message.empty());
  }
  CHECK((!kMemoryCounts || peak_bytes() - before < 64u << 20));
}

TEST_CASE("what is no file of relit at all is refused by name") {
  const Folder folder;
  const auto says = [&](const std::string& name, const std::string& content) {
    std::ofstream(folder.file(name.c_str()), std::ios::binary) << content;
    std::string message;
    CHECK(run_relit("info " + folder.file(name.c_str()), &message) == 1);
    CHECK(message.find(name) != std::string::npos);
    return message;
  };
  CHECK(says("text", "Dear Sir or Madam,\n").find("not a .relit file") != std::string::npos);
  says("empty", "");
  says("signature", std::string(reinterpret_cast<const char*>(container::kSignature.data()), 8));
  std::string message;
  CHECK(run_relit("info " + folder.path.string(), &message) != 0);
  CHECK(message.find("irectory") != std::string::npos);
  CHECK(run_relit("info " + folder.file("none"), &message) != 0);
  CHECK(message.find("none") != std::string::npos);
}
