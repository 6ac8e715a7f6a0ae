// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "bake_minimal/plane_layout.hpp"
#include "bake_minimal/plane_quantiser.hpp"
#include "bake_minimal/video_encoder.hpp"
#include "container/base/result.hpp"
#include "container/records.hpp"
#include "decoders/video_decoder.hpp"

/// Transfer -> layers and their packets (design, section 4).
namespace relit::bake {

struct ModelIds {
  std::uint32_t model_id = 0;
  std::uint32_t clip_id = 0;
  std::uint32_t first_layer_id = 0;
  std::uint32_t first_track_id = 0;  ///< a layer takes one, or two with exponents, in order
  std::uint32_t first_segment = 0;   ///< SegmentRecord::index of the clip's first segment
};

/// The chunks of one segment, in the order in which they belong into the file: by layer, mantissas
/// before exponents. SegmentRecord::chunks is the writer's to fill in.
struct EncodedSegment {
  container::SegmentRecord segment;
  std::vector<container::ChunkRecord> chunks;
};

/// Encodes a clip: begin(), encode_frame() for every frame, take_segment() as often as it gives
/// one, finish(), take_segment() again. Not thread-safe; layers are encoded on options.threads
/// threads inside encode_frame() and finish(). The bytes do not depend on the threads.
class PlaneEncoder {
 public:
  /// `scan` has seen all frames of the clip. Errors: kInvalid for a clip without frames; those of
  /// plan_layers() and VideoEncoder::open(); kInvalid when the decoders' pictures cannot be brought
  /// below options.decode_memory, naming what they take at least.
  static Result<PlaneEncoder> begin(RangeScan scan, const ModelIds& ids);

  [[nodiscard]] const container::ModelRecord& model() const { return model_; }
  /// Complete from begin() on.
  [[nodiscard]] const std::vector<container::LayerRecord>& layers() const { return layers_; }

  /// Bytes of the pictures that decoders of all layers hold together, padding included.
  [[nodiscard]] std::uint64_t decoder_bytes() const { return decoder_bytes_; }

  /// The frames that `scan` has seen, in the same order. Errors: those of
  /// PlaneSplit::begin_frame(); kInvalid when the frame exceeds the ranges scanned.
  Status encode_frame(const TransferFrame& frame);
  /// Errors: kInvalid when frames are missing.
  Status finish();

  /// The next segment whose packets are complete, if there is one.
  std::optional<EncodedSegment> take_segment();

 private:
  /// Collects the packets of one stream into chunks.
  struct Track {
    std::uint32_t id = 0;
    std::deque<container::ChunkRecord> chunks;  ///< the last one is still growing
    std::uint32_t begun = 0;                    ///< segments of which a packet has come
  };
  struct LayerState {
    LayerPlan plan;
    std::optional<VideoEncoder> mantissas;
    std::optional<VideoEncoder> exponents;
    Track mantissa_track;
    Track exponent_track;
    Components components;
    std::vector<std::uint8_t> block_exponents;
    std::vector<std::uint16_t> samples;
    std::vector<CodedPacket> packets;
  };

  PlaneEncoder(RangeScan scan, const ModelIds& ids);
  /// What a decoder may be asked to keep.
  struct Keeping {
    int reference_frames;
    Reordering reordering;
  };
  [[nodiscard]] static std::vector<Keeping> keepings(const CodingOptions& options);
  Status open_layers();
  Status count_pictures(const decoders::VideoFormat& format, int pictures);
  Status open_layer(LayerState& layer, const Keeping& keeping);
  Status encode_layer(LayerState& layer);
  Status quantise_tile(LayerState& layer, std::size_t place);
  Status finish_layer(LayerState& layer) const;
  Status collect(Track& track, std::vector<CodedPacket>& packets) const;
  Status for_each_layer(const std::function<Status(LayerState&)>& run);

  RangeScan scan_;
  ModelIds ids_;
  PlaneQuantiser quantiser_;
  PlaneSplit split_;
  std::vector<std::vector<PlaneQuantiser::Step>> steps_;
  container::ModelRecord model_;
  std::vector<container::LayerRecord> layers_;
  std::vector<std::unique_ptr<LayerState>> states_;
  std::uint64_t decoder_bytes_ = 0;
  std::uint64_t next_frame_ = 0;
  std::uint32_t next_segment_ = 0;
  bool finished_ = false;
};

}  // namespace relit::bake
