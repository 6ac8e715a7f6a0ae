// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "container/base/plane_view.hpp"
#include "container/base/result.hpp"
#include "container/records.hpp"
#include "decoders/video_decoder.hpp"

/// The packets of layers -> planes of the light map (design, section 4).
namespace relit::decoders {

/// All planes of a model at one frame, in the model's order. Planes of layers that were not asked
/// for have empty views. Holds references to the pictures: the views stay valid as long as this
/// object, whatever the decoder does meanwhile, and may be read from any thread. Reuse one object
/// from frame to frame, so that nothing is allocated.
class FrameView {
 public:
  FrameView() = default;
  /// Of planes that the caller owns and keeps, as from a decoder of a host's own.
  FrameView(std::uint64_t frame, std::vector<PlaneView> planes)
      : frame_(frame), planes_(std::move(planes)) {}
  [[nodiscard]] std::span<const PlaneView> planes() const { return planes_; }
  [[nodiscard]] std::uint64_t frame() const { return frame_; }
  /// Gives the pictures back to their decoders; all views become empty.
  void clear();

  /// Makes room for a frame whose views are all empty.
  void reset(std::uint64_t frame, std::size_t planes, std::size_t layers);
  /// Takes over a layer's pictures and leaves those it had, or empty ones: its planes begin at
  /// `first_plane`, its number is `layer`. `exponents` is null where the layer has none.
  void show(const container::LayerRecord& record, std::size_t first_plane, std::size_t layer,
            VideoFrame& mantissas, VideoFrame* exponents);

 private:
  friend class LayerDecoder;
  friend class PlaneDecoder;
  std::uint64_t frame_ = 0;
  std::vector<PlaneView> planes_;
  std::vector<VideoFrame> pictures_;  ///< two for each layer: mantissas, exponents
};

/// What the streams of a layer claim to be. exponent_format() is for layers that have exponents.
[[nodiscard]] VideoFormat mantissa_format(const container::LayerRecord& layer);
[[nodiscard]] VideoFormat exponent_format(const container::LayerRecord& layer);

/// The part of a component that a rectangle, in samples of component 0, covers; `shift` is 1 where
/// the component has half the width and height, else 0. Borrows the picture.
[[nodiscard]] SampleView crop(const VideoFrame& picture, int component, const container::Rect& rect,
                              int shift);

/// A plane of a layer in its decoded pictures, which the view borrows; `exponents` is null where
/// the layer has none. The samples of GBR pictures' planes follow the bitstream's order, so no
/// component is permuted. The layer must have passed check_layer().
[[nodiscard]] PlaneView view_plane(const container::LayerRecord& layer,
                                   const container::PlaneRecord& plane, const VideoFrame& mantissas,
                                   const VideoFrame* exponents);

/// Checks a layer against its model: sizes, rectangles inside their pictures and, with 4:2:0, on
/// even places, components that the chroma format has, finite positive scales, matrix entries in
/// range. Errors: kCorrupt, kLimit, kUnsupported, each naming layer and plane.
[[nodiscard]] Status check_layer(const container::ModelRecord& model,
                                 const container::LayerRecord& layer);

/// One track's chunks and the decoder that plays them: a picture for a frame, in any order, cheap
/// when frames are asked for one after another. Not thread-safe.
class TrackDecoder {
 public:
  static Result<TrackDecoder> open(const VideoFormat& format,
                                   const VideoDecoderOptions& options = {});

  /// Takes the packets of one segment. Errors: kCorrupt when ranges or time stamps are not the
  /// segment's; a chunk that is already there is replaced.
  Status add_chunk(const container::SegmentRecord& segment, container::ChunkRecord chunk);

  /// The picture shown at `frame`: the one with the greatest pts at or before it in its segment.
  /// Valid until the next call. Errors: kNotFound when that segment's chunk is not here; kCorrupt,
  /// naming track and frame, when the picture was damaged or depends on damage. Other frames remain
  /// decodable.
  Result<const VideoFrame*> picture(std::uint64_t frame);

  /// From now on frames are asked for that `n` divides, so that pictures which none of them shows
  /// are decoded only where others refer to them. Any other frame may be asked for all the same,
  /// and costs the segment from its beginning. At first 1.
  void show_every(std::uint64_t n);
  /// Pictures that the codec has given so far.
  [[nodiscard]] std::uint64_t pictures() const { return pictures_; }

  /// Keeps this chunk alone; `chunk` gets the storage of one that was kept before. So chunk after
  /// chunk is taken without an allocation. Errors: as add_chunk(); no chunk is here then.
  Status replace_chunk(const container::SegmentRecord& segment, container::ChunkRecord& chunk);

  void forget_before(std::uint64_t frame);
  void forget_all();
  [[nodiscard]] const VideoDecoder& decoder() const { return decoder_; }
  [[nodiscard]] bool has_segment_of(std::uint64_t frame) const;

 private:
  struct Chunk {
    std::uint64_t end_frame = 0;
    container::ChunkRecord record;
    std::vector<std::int64_t> shown;  ///< all pts, ascending
    /// For each packet, the least pts of those from it on.
    std::vector<std::int64_t> earliest;
  };
  using Chunks = std::map<std::uint64_t, Chunk>;  ///< by first frame

  TrackDecoder(VideoDecoder decoder, std::uint32_t track_id, int threads)
      : decoder_(std::move(decoder)), track_id_(track_id), threads_(threads) {}
  Status list_shown(const container::SegmentRecord& segment, Chunk& chunk) const;
  /// Whether `current_` is now the picture of that pts.
  bool decode_until(const Chunk& chunk, std::int64_t pts);
  [[nodiscard]] Chunks::const_iterator find(std::uint64_t frame) const;
  void restart(std::uint64_t first_frame);
  /// Makes `ahead_` the next picture of the chunk; leaves it empty at the end.
  void advance(const Chunk& chunk);
  void feed(const Chunk& chunk);
  [[nodiscard]] bool is_shown(const Chunk& chunk, std::int64_t pts) const;
  void pass_unshown(const Chunk& chunk);
  void note_damage(const Chunk& chunk, Error error);

  VideoDecoder decoder_;
  std::uint32_t track_id_;
  int threads_;
  Chunks chunks_;
  std::optional<std::uint64_t> segment_;  ///< first frame of the chunk in the decoder
  std::size_t next_packet_ = 0;
  std::size_t unshown_end_ = 0;  ///< no packet from the next one to this one is shown
  bool drained_ = false;
  bool skipping_ = false;  ///< after damage, until a key packet
  std::optional<Error> damage_;
  std::vector<std::int64_t> suspects_;  ///< pts of the packets that damage may have hit
  std::uint64_t every_ = 1;
  std::int64_t asked_ = -1;  ///< pts of the picture that is being decoded
  std::uint64_t pictures_ = 0;
  VideoFrame current_;
  VideoFrame ahead_;
};

/// One layer. Not thread-safe; layers are independent and may be decoded on threads of their own.
class LayerDecoder {
 public:
  /// Checks the layer as check_layer() does and opens its decoders.
  static Result<LayerDecoder> open(const container::ModelRecord& model,
                                   const container::LayerRecord& layer,
                                   const VideoDecoderOptions& options = {});

  /// Takes a chunk of either of the layer's tracks; kNotFound for one of other tracks.
  Status add_chunk(const container::SegmentRecord& segment, container::ChunkRecord chunk);

  /// Fills planes [first, first + plane_count()) and pictures 2·slot and 2·slot+1 of `out`, which
  /// has room for them. Errors as TrackDecoder::picture(); the planes are empty then.
  Status decode(std::uint64_t frame, std::size_t first, std::size_t slot, FrameView& out);

  void forget_before(std::uint64_t frame);
  void forget_all();
  [[nodiscard]] std::size_t plane_count() const { return layer_.planes.size(); }
  [[nodiscard]] const container::LayerRecord& record() const { return layer_; }

 private:
  LayerDecoder(container::LayerRecord layer, TrackDecoder mantissas)
      : layer_(std::move(layer)), mantissas_(std::move(mantissas)) {}

  container::LayerRecord layer_;
  TrackDecoder mantissas_;
  std::optional<TrackDecoder> exponents_;
};

struct PlaneDecoderOptions {
  int threads = 1;                       ///< of each mantissa decoder, see VideoDecoderOptions
  std::span<const std::uint8_t> wanted;  ///< by layer, 0: neither opened nor decoded; empty: all
  std::string decoder = {};              ///< VideoDecoderOptions::name
};

/// All wanted layers of one model on the caller's thread. Not thread-safe.
class PlaneDecoder {
 public:
  /// `layers` are those of the model, in order. Errors: kLimit for more planes than
  /// limits::kPlanes; those of check_layer() and VideoDecoder::open().
  static Result<PlaneDecoder> open(const container::ModelRecord& model,
                                   std::span<const container::LayerRecord> layers,
                                   const PlaneDecoderOptions& options = {});

  /// Takes a chunk and keeps it until forget_before(); chunks of layers that are not wanted, or of
  /// other tracks, are dropped. Errors: kCorrupt, kOutOfMemory.
  Status add_chunk(const container::SegmentRecord& segment, container::ChunkRecord chunk);

  /// The planes at `frame` (of the clip). Sequential use decodes every packet once; going elsewhere
  /// restarts at the segment. An error of one layer leaves the others filled and its planes empty,
  /// and the first error is returned. Errors: kNotFound (chunk missing), kCorrupt (damage),
  /// kOutOfMemory, which empties all of them.
  Status frame(std::uint64_t frame, FrameView& out);
  Result<FrameView> frame(std::uint64_t frame);

  /// Frees the chunks of segments that end at or before `frame`.
  void forget_before(std::uint64_t frame);
  void forget_all();

  [[nodiscard]] std::size_t plane_count() const { return plane_count_; }

 private:
  Status decode_layers(std::uint64_t frame, FrameView& out);

  std::vector<std::optional<LayerDecoder>> layers_;
  std::vector<std::size_t> first_plane_;
  std::size_t plane_count_ = 0;
};

/// value_k at texel (x, y), by the formula of PlaneView in double precision.
[[nodiscard]] double plane_value(const PlaneView& plane, int x, int y);

/// T[n,c] = s·A_l/π·Y_n(N) + μ[n,c] + Σ_k M[n,c,k]·value_k, summed in double precision. Empty
/// planes count as zero. `out` is float [coefficients][3][H][W]; `normals`, [H][W], are
/// TexelNormals' of the frame, and needed where the model has a prediction plane. Errors: kInvalid
/// when sizes do not fit.
Status reconstruct(std::span<const PlaneView> planes, const container::ModelRecord& model,
                   std::span<const container::LayerRecord> layers, std::span<float> out,
                   std::span<const glm::vec3> normals = {});

}  // namespace relit::decoders
