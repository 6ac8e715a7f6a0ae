// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "decoders/video_decoder.hpp"
#include "gles/plane_sheets.hpp"
#include "player/memory_plan.hpp"

/// The terms of a memory plan for one choice of what is negotiable.
namespace relit::player {

/// Frame threads of each mantissa decoder where `threads` workers share `layers` layers.
[[nodiscard]] int threads_of_decoder(int threads, std::size_t layers);

/// What a plan decides, in the order in which it is given up.
struct MemoryChoice {
  std::uint64_t ring_frames = 2;
  int threads = 1;
  CompositePath path = CompositePath::kCpu;
  gles::LightMapFormat light_map = gles::LightMapFormat::kHalfFloat;
  std::size_t layers = 1;  ///< from the most important on
  /// No choice: of another clip that plays with the same bounds of ring and packets.
  std::uint64_t frame_bytes = 0, segment_bytes = 0;
};

/// A clip as far as memory is concerned. Borrows the file's contents.
class MemoryAccount {
 public:
  /// Errors: kNotFound for a clip, a model or a pose track that is not there; those of
  /// check_layer().
  static Result<MemoryAccount> create(const container::FileContents& contents,
                                      const SegmentScale& segments, const MemoryWishes& wishes);

  [[nodiscard]] const container::ClipRecord& clip() const { return *clip_; }
  [[nodiscard]] std::size_t layer_count() const { return layers_.size(); }
  [[nodiscard]] bool drawn() const { return wishes_.drawing.has_value(); }

  /// One decoded frame: the pictures of the first `layers` layers, and the pose.
  [[nodiscard]] std::uint64_t frame_bytes(std::size_t layers) const;
  /// The largest segment's packets.
  [[nodiscard]] std::uint64_t segment_bytes() const { return segments_.bytes; }

  /// All terms but those that are zero. With `other`, also what that clip of the file takes while
  /// both play, and what fades between them.
  [[nodiscard]] std::vector<MemoryTerm> terms(const MemoryChoice& choice,
                                              const MemoryAccount* other = nullptr) const;
  /// What the clip takes of its own, beside what it shares with other clips of the file.
  [[nodiscard]] std::uint64_t own_bytes(const MemoryChoice& choice) const;

 private:
  MemoryAccount() = default;
  struct Track {
    decoders::VideoFormat format;
    int pictures = 1;  ///< by the file
    std::uint64_t picture_bytes = 0;
    bool mantissas = false;  ///< the others are decoded on one thread
  };
  struct Layer {
    const container::LayerRecord* record = nullptr;
    std::vector<Track> tracks;
  };

  Status find_records(const container::FileContents& contents);
  void measure_images();
  void measure_layers();
  void measure_poses();
  void measure_sheets();

  void add_file(std::vector<MemoryTerm>& terms) const;
  void add_decoding(std::vector<MemoryTerm>& terms, const MemoryChoice& choice) const;
  void add_composite(std::vector<MemoryTerm>& terms, const MemoryChoice& choice) const;
  void add_other(std::vector<MemoryTerm>& terms, const MemoryChoice& choice,
                 const MemoryAccount& other) const;
  void add_drawing(std::vector<MemoryTerm>& terms) const;
  [[nodiscard]] std::vector<MemoryTerm> own_terms(const MemoryChoice& choice) const;
  [[nodiscard]] std::uint64_t segments_held(std::uint64_t ring_frames) const;

  const container::FileContents* contents_ = nullptr;
  const container::ClipRecord* clip_ = nullptr;
  const container::ModelRecord* model_ = nullptr;
  const container::PoseTrackRecord* pose_ = nullptr;
  MemoryWishes wishes_;
  SegmentScale segments_;
  std::vector<Layer> layers_;
  std::uint64_t pose_frame_bytes_ = 0;    ///< sampled
  std::uint64_t pose_segment_bytes_ = 0;  ///< decoded
  std::uint64_t pose_fixed_bytes_ = 0;
  std::uint64_t images_working_bytes_ = 0;
  std::uint64_t images_gpu_bytes_ = 0;
  gles::PlaneSheets::Bytes sheets_;  ///< of the planes of all layers
  std::uint64_t plane_count_ = 0;
  bool sheets_possible_ = false;
};

}  // namespace relit::player
