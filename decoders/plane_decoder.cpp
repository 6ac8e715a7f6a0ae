// SPDX-License-Identifier: MIT
#include "decoders/plane_decoder.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <string>

#include "container/base/limits.hpp"
#include "container/base/out_of_memory.hpp"
#include "decoders/sh.hpp"

namespace relit::decoders {
namespace {

using container::Chroma;
using container::LayerRecord;
using container::ModelRecord;
using container::PlaneRecord;
using container::Rect;

std::string size_text(unsigned width, unsigned height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

bool inside(const Rect& rect, unsigned width, unsigned height) {
  return rect.width > 0 && rect.height > 0 && unsigned{rect.x} + rect.width <= width &&
         unsigned{rect.y} + rect.height <= height;
}

Status check_plane(const ModelRecord& model, const LayerRecord& layer, const PlaneRecord& plane,
                   const std::string& where) {
  const Rect& m = plane.mantissa_rect;
  if (plane.component >= (layer.chroma == Chroma::kLuma ? 1 : 3)) {
    return fail(ErrorCode::kCorrupt, where + ": component " + std::to_string(plane.component) +
                                         " is not in pictures of this chroma format");
  }
  if (m.width != model.width || m.height != model.height) {
    return fail(ErrorCode::kCorrupt, where + ": mantissas of " + size_text(m.width, m.height) +
                                         ", the light map is " +
                                         size_text(model.width, model.height));
  }
  if (!inside(m, layer.coded_width, layer.coded_height)) {
    return fail(ErrorCode::kCorrupt, where + ": its mantissas reach outside the picture");
  }
  if (layer.chroma == Chroma::k420 && plane.component > 0 && (m.x % 2 != 0 || m.y % 2 != 0)) {
    return fail(ErrorCode::kCorrupt, where + ": 4:2:0 needs an even corner");
  }
  if (layer.has_exponents) {
    const unsigned g = layer.exponent_block;
    const Rect& e = plane.exponent_rect;
    if (e.width != (model.width + g - 1) / g || e.height != (model.height + g - 1) / g ||
        !inside(e, layer.exponent_width, layer.exponent_height)) {
      return fail(ErrorCode::kCorrupt,
                  where + ": its exponents are " + size_text(e.width, e.height) +
                      " and have to cover the light map in blocks inside their picture");
    }
  }
  if (!(plane.scale > 0) || !std::isfinite(plane.scale)) {
    return fail(ErrorCode::kCorrupt, where + ": its scale is not finite and positive");
  }
  for (const container::MatrixEntry& entry : plane.matrix) {
    if (entry.coefficient >= coefficient_count(model.order) || entry.channel > 2 ||
        !std::isfinite(entry.value)) {
      return fail(ErrorCode::kCorrupt, where + ": a matrix entry is out of range");
    }
  }
  return {};
}

}  // namespace

VideoFormat mantissa_format(const LayerRecord& layer) {
  return {layer.codec,  layer.codec_private, layer.coded_width,   layer.coded_height,
          layer.chroma, layer.bit_depth,     layer.mantissa_track};
}

VideoFormat exponent_format(const LayerRecord& layer) {
  return {layer.exponent_codec,  layer.exponent_private, layer.exponent_width,
          layer.exponent_height, Chroma::kLuma,          8,
          layer.exponent_track};
}

SampleView crop(const VideoFrame& picture, int component, const Rect& rect, int shift) {
  SampleView view = picture.component(component);
  view.data += (rect.y >> shift) * view.stride_bytes +
               std::ptrdiff_t{rect.x >> shift} * view.bytes_per_sample;
  view.width = (rect.width + (1 << shift) - 1) >> shift;
  view.height = (rect.height + (1 << shift) - 1) >> shift;
  return view;
}

PlaneView view_plane(const LayerRecord& layer, const PlaneRecord& plane,
                     const VideoFrame& mantissas, const VideoFrame* exponents) {
  PlaneView view;
  view.mantissa_shift = layer.chroma == Chroma::k420 && plane.component > 0 ? 1 : 0;
  view.mantissa = crop(mantissas, plane.component, plane.mantissa_rect, view.mantissa_shift);
  view.mantissa_zero = layer.bit_depth == 8 ? 128 : 512;
  view.exponent_zero = layer.bit_depth == 8 ? 135 : 137;
  view.scale = plane.scale;
  if (exponents != nullptr) {
    view.exponent = crop(*exponents, 0, plane.exponent_rect, 0);
    view.exponent_shift = std::countr_zero(unsigned{layer.exponent_block});
  }
  return view;
}

Status check_layer(const ModelRecord& model, const LayerRecord& layer) {
  const std::string where = "layer " + std::to_string(layer.id);
  if (model.order > limits::kShOrder || model.width < 1 || model.height < 1 ||
      model.width > limits::kLightMapSide || model.height > limits::kLightMapSide) {
    return fail(ErrorCode::kLimit, "model " + std::to_string(model.id) +
                                       ": order or size of the light map beyond the limits");
  }
  if (layer.planes.size() > limits::kPlanes) {
    return fail(ErrorCode::kLimit, where + ": too many planes");
  }
  if (layer.bit_depth != 8 && layer.bit_depth != 10) {
    return fail(
        ErrorCode::kUnsupported,
        where + ": mantissas of " + std::to_string(layer.bit_depth) + " bits, known are 8 and 10");
  }
  if (layer.has_exponents &&
      (!std::has_single_bit(unsigned{layer.exponent_block}) || layer.exponent_block > 32)) {
    return fail(ErrorCode::kCorrupt, where + ": exponent blocks of " +
                                         std::to_string(layer.exponent_block) +
                                         " texels, allowed are 1, 2, 4, 8, 16 and 32");
  }
  if (layer.has_exponents && layer.exponent_codec != "ffv1") {
    return fail(ErrorCode::kUnsupported, where + ": exponents are coded with \"" +
                                             layer.exponent_codec + "\", known is ffv1");
  }
  for (std::size_t k = 0; k < layer.planes.size(); ++k) {
    RELIT_TRY(check_plane(model, layer, layer.planes[k], where + ", plane " + std::to_string(k)));
  }
  return {};
}

void FrameView::clear() {
  std::fill(planes_.begin(), planes_.end(), PlaneView{});
  for (VideoFrame& picture : pictures_) picture.clear();
}

void FrameView::reset(std::uint64_t frame, std::size_t planes, std::size_t layers) {
  planes_.resize(planes);
  pictures_.resize(2 * layers);
  clear();
  frame_ = frame;
}

void FrameView::show(const LayerRecord& record, std::size_t first_plane, std::size_t layer,
                     VideoFrame& mantissas, VideoFrame* exponents) {
  std::swap(pictures_[2 * layer], mantissas);
  if (exponents != nullptr) std::swap(pictures_[2 * layer + 1], *exponents);
  for (std::size_t k = 0; k < record.planes.size(); ++k) {
    planes_[first_plane + k] =
        view_plane(record, record.planes[k], pictures_[2 * layer],
                   exponents != nullptr ? &pictures_[2 * layer + 1] : nullptr);
  }
}

Result<LayerDecoder> LayerDecoder::open(const ModelRecord& model, const LayerRecord& layer,
                                        const VideoDecoderOptions& options) {
  RELIT_TRY(check_layer(model, layer));
  RELIT_ASSIGN(TrackDecoder mantissas, TrackDecoder::open(mantissa_format(layer), options));
  LayerDecoder decoder(layer, std::move(mantissas));
  if (layer.has_exponents) {
    RELIT_ASSIGN(TrackDecoder exponents, TrackDecoder::open(exponent_format(layer)));
    decoder.exponents_.emplace(std::move(exponents));
  }
  return decoder;
}

Status LayerDecoder::add_chunk(const container::SegmentRecord& segment,
                               container::ChunkRecord chunk) {
  if (chunk.track_id == layer_.mantissa_track) {
    return mantissas_.add_chunk(segment, std::move(chunk));
  }
  if (exponents_ && chunk.track_id == layer_.exponent_track) {
    return exponents_->add_chunk(segment, std::move(chunk));
  }
  return fail(ErrorCode::kNotFound, "track " + std::to_string(chunk.track_id) +
                                        " does not belong to layer " + std::to_string(layer_.id));
}

Status LayerDecoder::decode(std::uint64_t frame, std::size_t first, std::size_t slot,
                            FrameView& out) {
  const std::span<PlaneView> planes = std::span(out.planes_).subspan(first, layer_.planes.size());
  std::fill(planes.begin(), planes.end(), PlaneView{});
  VideoFrame& mantissas = out.pictures_[2 * slot];
  VideoFrame& exponents = out.pictures_[2 * slot + 1];
  mantissas.clear();
  exponents.clear();
  RELIT_ASSIGN(const VideoFrame* mantissa_picture, mantissas_.picture(frame));
  mantissas = *mantissa_picture;
  if (exponents_) {
    RELIT_ASSIGN(const VideoFrame* exponent_picture, exponents_->picture(frame));
    exponents = *exponent_picture;
  }
  if (mantissas.empty() || (exponents_ && exponents.empty())) {
    return fail(ErrorCode::kOutOfMemory, "no memory for a reference to a picture");
  }
  for (std::size_t k = 0; k < planes.size(); ++k) {
    planes[k] = view_plane(layer_, layer_.planes[k], mantissas, exponents_ ? &exponents : nullptr);
  }
  return {};
}

void LayerDecoder::forget_before(std::uint64_t frame) {
  mantissas_.forget_before(frame);
  if (exponents_) exponents_->forget_before(frame);
}

void LayerDecoder::forget_all() {
  mantissas_.forget_all();
  if (exponents_) exponents_->forget_all();
}

Result<PlaneDecoder> PlaneDecoder::open(const ModelRecord& model,
                                        std::span<const LayerRecord> layers,
                                        const PlaneDecoderOptions& options) {
  return catch_out_of_memory("opening the decoders of a model", [&]() -> Result<PlaneDecoder> {
    if (!options.wanted.empty() && options.wanted.size() != layers.size()) {
      return fail(ErrorCode::kInvalid,
                  "one choice for each of the " + std::to_string(layers.size()) +
                      " layers is needed, got " + std::to_string(options.wanted.size()));
    }
    PlaneDecoder decoder;
    for (std::size_t i = 0; i < layers.size(); ++i) {
      decoder.first_plane_.push_back(decoder.plane_count_);
      decoder.plane_count_ += layers[i].planes.size();
      if (decoder.plane_count_ > limits::kPlanes) {
        return fail(ErrorCode::kLimit, "more than " + std::to_string(limits::kPlanes) + " planes");
      }
      decoder.layers_.emplace_back();
      if (!options.wanted.empty() && !options.wanted[i]) continue;
      RELIT_ASSIGN(
          LayerDecoder layer,
          LayerDecoder::open(model, layers[i], {options.threads, options.decoder, nullptr}));
      decoder.layers_.back().emplace(std::move(layer));
    }
    return decoder;
  });
}

Status PlaneDecoder::add_chunk(const container::SegmentRecord& segment,
                               container::ChunkRecord chunk) {
  return catch_out_of_memory("taking a chunk", [&]() -> Status {
    for (std::optional<LayerDecoder>& layer : layers_) {
      if (!layer) continue;
      const LayerRecord& record = layer->record();
      if (chunk.track_id == record.mantissa_track ||
          (record.has_exponents && chunk.track_id == record.exponent_track)) {
        return layer->add_chunk(segment, std::move(chunk));
      }
    }
    return {};
  });
}

Status PlaneDecoder::frame(std::uint64_t frame, FrameView& out) {
  Status decoded =
      catch_out_of_memory("decoding a frame", [&] { return decode_layers(frame, out); });
  // Views of pictures that are gone must not stay.
  if (!decoded && decoded.error().code == ErrorCode::kOutOfMemory) out.clear();
  return decoded;
}

Status PlaneDecoder::decode_layers(std::uint64_t frame, FrameView& out) {
  out.planes_.resize(plane_count_);
  out.pictures_.resize(2 * layers_.size());
  out.frame_ = frame;
  Status first_error;
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    if (!layers_[i]) {
      for (std::size_t k = first_plane_[i];
           k < (i + 1 < layers_.size() ? first_plane_[i + 1] : plane_count_); ++k) {
        out.planes_[k] = PlaneView{};
      }
      continue;
    }
    Status status = layers_[i]->decode(frame, first_plane_[i], i, out);
    if (!status && first_error) first_error = std::move(status);
  }
  return first_error;
}

Result<FrameView> PlaneDecoder::frame(std::uint64_t frame_index) {
  FrameView view;
  RELIT_TRY(frame(frame_index, view));
  return view;
}

void PlaneDecoder::forget_before(std::uint64_t frame) {
  for (std::optional<LayerDecoder>& layer : layers_) {
    if (layer) layer->forget_before(frame);
  }
}

void PlaneDecoder::forget_all() {
  for (std::optional<LayerDecoder>& layer : layers_) {
    if (layer) layer->forget_all();
  }
}

double plane_value(const PlaneView& plane, int x, int y) {
  int exponent = plane.exponent_zero;
  if (!plane.exponent.empty()) {
    exponent = plane.exponent.at(x >> plane.exponent_shift, y >> plane.exponent_shift);
    if (exponent == 0) return 0;
  }
  const int mantissa = plane.mantissa.at(x >> plane.mantissa_shift, y >> plane.mantissa_shift);
  return std::ldexp(double{plane.scale} * (mantissa - plane.mantissa_zero),
                    exponent - plane.exponent_zero);
}

namespace {

/// Adds s·A_l/π·Y_n(N) to [coefficients][3][texels].
void add_prediction(std::span<const double> scales, std::span<const glm::vec3> normals, int order,
                    std::span<double> sum) {
  std::array<double, limits::kCoefficients> y{};
  const auto coefficients = static_cast<std::size_t>(coefficient_count(order));
  for (std::size_t p = 0; p < scales.size(); ++p) {
    evaluate_sh(order, glm::dvec3(normals[p]), std::span(y).first(coefficients));
    for (std::size_t i = 0; i < coefficients * 3; ++i) {
      const double cosine = clamped_cosine(band_of(static_cast<int>(i / 3))) / std::numbers::pi;
      sum[i * scales.size() + p] += scales[p] * cosine * y[i / 3];
    }
  }
}

}  // namespace

Status reconstruct(std::span<const PlaneView> planes, const ModelRecord& model,
                   std::span<const LayerRecord> layers, std::span<float> out,
                   std::span<const glm::vec3> normals) {
  const auto coefficients = static_cast<std::size_t>(coefficient_count(model.order));
  const std::size_t texels = std::size_t{model.width} * model.height;
  if (model.order > limits::kShOrder || out.size() != coefficients * 3 * texels ||
      (!model.mean.empty() && model.mean.size() != coefficients)) {
    return fail(ErrorCode::kInvalid, "the transfer's array or the model's mean is not of " +
                                         std::to_string(coefficients) + " coefficients of " +
                                         size_text(model.width, model.height) + " texels");
  }
  if (model.prediction_plane >= 0 && normals.size() != texels) {
    return fail(ErrorCode::kInvalid, "the model's prediction needs " + std::to_string(texels) +
                                         " normals, not " + std::to_string(normals.size()));
  }
  std::vector<double> sum(out.size());
  for (std::size_t i = 0; i < coefficients * 3 && !model.mean.empty(); ++i) {
    std::fill_n(sum.begin() + static_cast<std::ptrdiff_t>(i * texels), texels,
                double{model.mean[i / 3][i % 3]});
  }
  std::vector<double> values(texels);
  std::size_t k = 0;
  for (const LayerRecord& layer : layers) {
    for (const PlaneRecord& record : layer.planes) {
      if (k >= planes.size()) {
        return fail(ErrorCode::kInvalid, "the layers have more planes than the frame");
      }
      const bool predicts = static_cast<std::int64_t>(k) == model.prediction_plane;
      const PlaneView& plane = planes[k++];
      if (plane.mantissa.empty()) continue;
      for (std::size_t p = 0; p < texels; ++p) {
        values[p] = plane_value(plane, static_cast<int>(p % model.width),
                                static_cast<int>(p / model.width));
      }
      if (predicts) add_prediction(values, normals, model.order, sum);
      for (const container::MatrixEntry& entry : record.matrix) {
        if (entry.coefficient >= coefficients || entry.channel > 2) {
          return fail(ErrorCode::kInvalid, "a matrix entry is out of range");
        }
        double* target = sum.data() + (entry.coefficient * 3u + entry.channel) * texels;
        for (std::size_t p = 0; p < texels; ++p) target[p] += double{entry.value} * values[p];
      }
    }
  }
  std::transform(sum.begin(), sum.end(), out.begin(),
                 [](double v) { return static_cast<float>(v); });
  return {};
}

}  // namespace relit::decoders
