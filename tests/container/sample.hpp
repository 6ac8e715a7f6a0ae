// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "container/byte_sink.hpp"
#include "container/byte_source.hpp"
#include "container/framing.hpp"
#include "container/reader.hpp"
#include "container/records.hpp"
#include "container/writer.hpp"

/// A small, complete file that uses every record, and the means to look at it.
namespace relit::container::sample {

using Bytes = std::vector<std::uint8_t>;

ClipRecord clip(std::uint32_t id = 7, std::uint64_t frames = 5);
ImageRecord image();
MaterialRecord material();
MeshRecord mesh();
SkeletonRecord skeleton();
PoseTrackRecord pose_track();
PoseTrackRecord vertex_track();
ModelRecord model();
/// Layer with exponents, 4:2:0, tracks 2 and 3.
LayerRecord layer();
/// Second layer: luma, no exponents, track 4.
LayerRecord second_layer();
/// Chunk of a packet a frame.
ChunkRecord chunk(std::uint32_t track, std::uint64_t first_frame, std::uint32_t frame_count);
/// The chunks of all four tracks.
std::vector<ChunkRecord> chunks(std::uint64_t first_frame, std::uint32_t frame_count);

/// Adds everything before the first segment.
void add_static(Writer& writer);
/// Frames 0..4 in segments of 2, 2 and 1 frames.
Bytes file();

/// A source that gives at most `step` bytes a read and cannot seek.
class Pipe final : public ByteSource {
 public:
  explicit Pipe(Bytes bytes, std::size_t step = 7) : bytes_(std::move(bytes)), step_(step) {}
  Result<std::size_t> read(std::span<std::uint8_t> out) override;

 private:
  Bytes bytes_;
  std::size_t position_ = 0;
  std::size_t step_;
};

std::unique_ptr<ByteSource> memory(Bytes bytes);

struct Everything {
  FileContents contents;
  std::vector<RecordBody> rest;  ///< after the static part
  bool finished = false;
  std::vector<Error> errors;  ///< of next(), after which it went on as far as it could
  ReaderLoss loss;
};
/// Reads a file to its end, with resync() after damage. An error in the static part ends it.
Result<Everything> read_everything(std::unique_ptr<ByteSource> source,
                                   const ReaderOptions& options = {});

bool same(const FileContents& a, const FileContents& b);
bool same(const Everything& a, const Everything& b);

/// Offsets of all records of an intact file, the header first.
std::vector<std::uint64_t> record_offsets(const Bytes& file);
/// Offset of the n-th record of a type.
std::uint64_t offset_of(const Bytes& file, RecordType type, int n = 0);
RecordType type_at(const Bytes& file, std::uint64_t offset);
/// `bytes` put into the file at `offset`, or written over what is there.
Bytes with_inserted(const Bytes& file, std::uint64_t offset, const Bytes& bytes);

/// A fresh directory, removed with all it holds.
class TemporaryDirectory {
 public:
  TemporaryDirectory();
  ~TemporaryDirectory();
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;
  [[nodiscard]] std::string path(const std::string& name) const { return root_ + "/" + name; }
  [[nodiscard]] std::vector<std::string> names() const;

 private:
  std::string root_;
};

}  // namespace relit::container::sample
