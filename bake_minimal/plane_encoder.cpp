// SPDX-License-Identifier: MIT
#include "bake_minimal/plane_encoder.hpp"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <exception>
#include <numeric>
#include <string>
#include <thread>
#include <utility>

#include "decoders/decoder_memory.hpp"
#include "decoders/plane_decoder.hpp"

namespace relit::bake {
namespace {

using container::LayerRecord;

/// Writes `samples` (width × height) at (x, y) and repeats the last column and row until the tile
/// has `padded_width` × `padded_height`.
struct TileCopy {
  std::span<const std::uint16_t> samples;
  int width, height;
  int x, y;
  int padded_width, padded_height;
};

void store(const TileCopy& tile, const SampleTarget& target) {
  for (int row = 0; row < tile.padded_height; ++row) {
    const std::uint16_t* source =
        tile.samples.data() + std::ptrdiff_t{std::min(row, tile.height - 1)} * tile.width;
    std::uint8_t* line = target.data + (tile.y + row) * target.stride_bytes +
                         std::ptrdiff_t{tile.x} * target.bytes_per_sample;
    for (int column = 0; column < tile.padded_width; ++column) {
      const std::uint16_t sample = source[std::min(column, tile.width - 1)];
      if (target.bytes_per_sample == 1) {
        line[column] = static_cast<std::uint8_t>(sample);
      } else {
        std::memcpy(line + 2 * column, &sample, sizeof sample);
      }
    }
  }
}

VideoSettings mantissa_settings(const LayerRecord& record, const CodingOptions& o) {
  VideoSettings s;
  s.codec = record.codec;
  s.width = record.coded_width;
  s.height = record.coded_height;
  s.chroma = record.chroma;
  s.bit_depth = record.bit_depth;
  s.lossless = record.lossless;
  s.crf = *o.crf;
  s.preset = o.preset;
  s.segment_frames = o.segment_frames;
  return s;
}

/// FFV1 counts pictures, of which a segment has one for each hold.
VideoSettings exponent_settings(const LayerRecord& record, const RangeScan& scan) {
  const int segment = scan.options().segment_frames, hold = scan.hold_frames();
  VideoSettings s;
  s.codec = record.exponent_codec;
  s.width = record.exponent_width;
  s.height = record.exponent_height;
  s.lossless = true;
  s.segment_frames = (segment + hold - 1) / hold;
  return s;
}

}  // namespace

PlaneEncoder::PlaneEncoder(RangeScan scan, const ModelIds& ids)
    : scan_(std::move(scan)),
      ids_(ids),
      quantiser_(scan_.split().shape(), scan_.options()),
      split_(scan_.split()),
      steps_(scan_.steps()) {
  model_.id = ids.model_id;
  model_.clip_id = ids.clip_id;
  model_.order = static_cast<std::uint8_t>(split_.shape().order);
  model_.width = static_cast<std::uint16_t>(split_.shape().width);
  model_.height = static_cast<std::uint16_t>(split_.shape().height);
  model_.mean = scan_.mean();
  model_.prediction_plane = split_.prediction_plane();
}

Result<PlaneEncoder> PlaneEncoder::begin(RangeScan scan, const ModelIds& ids) {
  if (scan.frame_count() == 0) return fail(ErrorCode::kInvalid, "the clip has no frames");
  PlaneEncoder encoder(std::move(scan), ids);
  RELIT_ASSIGN(std::vector<LayerPlan> plans,
               plan_layers(encoder.split_, encoder.scan_.options(),
                           {ids.model_id, ids.first_layer_id, ids.first_track_id}));
  for (LayerPlan& plan : plans) {
    auto state = std::make_unique<LayerState>();
    state->plan = std::move(plan);
    encoder.states_.push_back(std::move(state));
  }
  RELIT_TRY(encoder.open_layers());
  for (const auto& state : encoder.states_) encoder.layers_.push_back(state->plan.record);
  return encoder;
}

// From what compresses best to what a decoder has least to keep for. A pyramid takes four
// references whatever is asked for.
std::vector<PlaneEncoder::Keeping> PlaneEncoder::keepings(const CodingOptions& o) {
  std::vector<Keeping> list{{o.reference_frames, Reordering::kPyramid}};
  const bool adjustable = o.codec == "h264" || o.codec == "hevc";
  if (o.decode_memory == 0 || !adjustable) return list;
  for (int references = o.reference_frames; references >= 1; --references) {
    list.push_back({references, Reordering::kFlat});
  }
  list.push_back({1, Reordering::kNone});
  return list;
}

Status PlaneEncoder::open_layers() {
  const std::uint64_t budget = scan_.options().decode_memory;
  for (const Keeping& keeping : keepings(scan_.options())) {
    decoder_bytes_ = 0;
    for (const auto& state : states_) {
      RELIT_TRY(open_layer(*state, keeping));
      const LayerRecord& record = state->plan.record;
      RELIT_TRY(count_pictures(decoders::mantissa_format(record), record.mantissa_pictures));
      if (record.has_exponents) {
        RELIT_TRY(count_pictures(decoders::exponent_format(record), record.exponent_pictures));
      }
    }
    if (budget == 0 || decoder_bytes_ <= budget) return {};
  }
  return fail(ErrorCode::kInvalid, "--decode-memory " + std::to_string(budget) +
                                       ": with this codec and size the pictures "
                                       "of the decoders take at least " +
                                       std::to_string(decoder_bytes_) +
                                       " bytes; use a smaller --size or --order, or --bit-depth 8");
}

Status PlaneEncoder::count_pictures(const decoders::VideoFormat& format, int pictures) {
  RELIT_ASSIGN(const std::uint64_t bytes, decoders::picture_buffer_bytes(format));
  decoder_bytes_ += bytes * decoders::decoder_memory(format, pictures, 1).pictures;
  return {};
}

Status PlaneEncoder::open_layer(LayerState& layer, const Keeping& keeping) {
  LayerRecord& record = layer.plan.record;
  const auto components = static_cast<std::size_t>(split_.components());
  for (std::size_t k = 0; k < record.planes.size(); ++k) {
    const auto tile = static_cast<std::size_t>(layer.plan.tiles[k / components]);
    record.planes[k].scale = static_cast<float>(steps_[tile][k % components].scale);
  }
  VideoSettings settings = mantissa_settings(record, scan_.options());
  settings.reference_frames = keeping.reference_frames;
  settings.reordering = keeping.reordering;
  RELIT_ASSIGN(VideoEncoder mantissas, VideoEncoder::open(settings));
  record.codec_private = mantissas.codec_private();
  record.mantissa_pictures = mantissas.decoder_pictures();
  layer.mantissas.emplace(std::move(mantissas));
  layer.mantissa_track.id = record.mantissa_track;
  if (record.has_exponents) {
    RELIT_ASSIGN(VideoEncoder exponents, VideoEncoder::open(exponent_settings(record, scan_)));
    record.exponent_private = exponents.codec_private();
    record.exponent_pictures = exponents.decoder_pictures();
    layer.exponents.emplace(std::move(exponents));
    layer.exponent_track.id = record.exponent_track;
  }
  return {};
}

Status PlaneEncoder::encode_frame(const TransferFrame& frame) {
  if (next_frame_ >= scan_.frame_count()) {
    return fail(ErrorCode::kInvalid, "more frames than the " + std::to_string(scan_.frame_count()) +
                                         " that were scanned");
  }
  RELIT_TRY(split_.begin_frame(frame, next_frame_));
  RELIT_TRY(for_each_layer([&](LayerState& layer) { return encode_layer(layer); }));
  ++next_frame_;
  return {};
}

Status PlaneEncoder::encode_layer(LayerState& layer) {
  const bool first_of_segment =
      next_frame_ % static_cast<std::uint64_t>(scan_.options().segment_frames) == 0;
  const auto pts = static_cast<std::int64_t>(next_frame_);
  RELIT_TRY(layer.mantissas->begin_picture());
  if (layer.exponents) RELIT_TRY(layer.exponents->begin_picture());
  for (std::size_t i = 0; i < layer.plan.tiles.size(); ++i) RELIT_TRY(quantise_tile(layer, i));
  RELIT_TRY(layer.mantissas->encode(pts, first_of_segment, layer.packets));
  RELIT_TRY(collect(layer.mantissa_track, layer.packets));
  if (layer.exponents && scan_.begins_hold(next_frame_)) {
    RELIT_TRY(layer.exponents->encode(pts, first_of_segment, layer.packets));
    RELIT_TRY(collect(layer.exponent_track, layer.packets));
  }
  return {};
}

Status PlaneEncoder::quantise_tile(LayerState& layer, std::size_t place) {
  const LayerRecord& record = layer.plan.record;
  const int tile = layer.plan.tiles[place];
  const int components = split_.components();
  split_.split(tile, layer.components.full);
  quantiser_.halve_chroma(layer.components);
  layer.block_exponents.clear();
  if (layer.exponents) {
    const std::span<const std::uint8_t> held = scan_.held_exponents(next_frame_, tile);
    layer.block_exponents.assign(held.begin(), held.end());
    if (held.empty()) {
      layer.block_exponents.resize(quantiser_.blocks());
      quantiser_.raise_exponents(layer.components, layer.block_exponents);
    }
    const container::Rect& rect =
        record.planes[place * static_cast<std::size_t>(components)].exponent_rect;
    layer.samples.assign(layer.block_exponents.begin(), layer.block_exponents.end());
    store({layer.samples, rect.width, rect.height, rect.x, rect.y, rect.width, rect.height},
          layer.exponents->target(0));
  }
  for (int c = 0; c < components; ++c) {
    const container::Rect& rect =
        record.planes[place * static_cast<std::size_t>(components) + static_cast<std::size_t>(c)]
            .mantissa_rect;
    const PlaneQuantiser::Step& step =
        steps_[static_cast<std::size_t>(tile)][static_cast<std::size_t>(c)];
    if (!quantiser_.quantise(layer.components, c, step, layer.block_exponents, layer.samples)) {
      return fail(ErrorCode::kInvalid, "frame " + std::to_string(next_frame_) + ", tile " +
                                           std::to_string(tile) +
                                           " exceeds its range: it is not the frame that was "
                                           "scanned");
    }
    const int shift = quantiser_.halved(c) ? 1 : 0;
    store({layer.samples, (rect.width + shift) >> shift, (rect.height + shift) >> shift,
           rect.x >> shift, rect.y >> shift, padded_side(rect.width) >> shift,
           padded_side(rect.height) >> shift},
          layer.mantissas->target(c));
  }
  return {};
}

Status PlaneEncoder::collect(Track& track, std::vector<CodedPacket>& packets) const {
  for (const CodedPacket& packet : packets) {
    const auto frames = static_cast<std::int64_t>(scan_.options().segment_frames);
    const auto segment = static_cast<std::uint32_t>(packet.pts / frames);
    const bool begins = segment == track.begun;
    // What the format promises of a segment, whatever the encoder at hand does.
    if (packet.bytes.empty() || segment > track.begun || segment + 1 < track.begun ||
        (begins && (!packet.key || packet.pts % frames != 0))) {
      return fail(ErrorCode::kEnvironment, "the encoder's segments are not closed at frame " +
                                               std::to_string(packet.pts) +
                                               ": use another --codec or --preset");
    }
    if (begins) {
      track.chunks.emplace_back();
      track.chunks.back().track_id = track.id;
      track.chunks.back().segment_index = ids_.first_segment + segment;
      ++track.begun;
    }
    container::ChunkRecord& chunk = track.chunks.back();
    chunk.packets.push_back({packet.pts, packet.key, chunk.data.size(), packet.bytes.size()});
    chunk.data.insert(chunk.data.end(), packet.bytes.begin(), packet.bytes.end());
  }
  packets.clear();
  return {};
}

Status PlaneEncoder::finish() {
  if (finished_) return {};
  if (next_frame_ != scan_.frame_count()) {
    return fail(ErrorCode::kInvalid, std::to_string(next_frame_) + " frames were given, " +
                                         std::to_string(scan_.frame_count()) + " were scanned");
  }
  RELIT_TRY(for_each_layer([&](LayerState& layer) { return finish_layer(layer); }));
  finished_ = true;
  return {};
}

Status PlaneEncoder::finish_layer(LayerState& layer) const {
  RELIT_TRY(layer.mantissas->finish(layer.packets));
  RELIT_TRY(collect(layer.mantissa_track, layer.packets));
  if (layer.exponents) {
    RELIT_TRY(layer.exponents->finish(layer.packets));
    RELIT_TRY(collect(layer.exponent_track, layer.packets));
  }
  return {};
}

std::optional<EncodedSegment> PlaneEncoder::take_segment() {
  // A chunk is complete when its successor has begun: decoding order never goes back.
  const auto complete = [&](const Track& track) {
    return finished_ ? !track.chunks.empty() : track.begun > next_segment_ + 1;
  };
  for (const auto& state : states_) {
    if (!complete(state->mantissa_track)) return {};
    if (state->exponents && !complete(state->exponent_track)) return {};
  }
  const auto frames = static_cast<std::uint64_t>(scan_.options().segment_frames);
  EncodedSegment encoded;
  encoded.segment.index = ids_.first_segment + next_segment_;
  encoded.segment.clip_id = ids_.clip_id;
  encoded.segment.first_frame = next_segment_ * frames;
  encoded.segment.frame_count = static_cast<std::uint32_t>(
      std::min(frames, scan_.frame_count() - encoded.segment.first_frame));
  for (const auto& state : states_) {
    encoded.chunks.push_back(std::move(state->mantissa_track.chunks.front()));
    state->mantissa_track.chunks.pop_front();
    if (!state->exponents) continue;
    encoded.chunks.push_back(std::move(state->exponent_track.chunks.front()));
    state->exponent_track.chunks.pop_front();
  }
  ++next_segment_;
  return encoded;
}

Status PlaneEncoder::for_each_layer(const std::function<Status(LayerState&)>& run) {
  std::vector<Status> results(states_.size());
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    // From the last layer on, which is the largest.
    for (std::size_t i; (i = next++) < states_.size();) {
      const std::size_t layer = states_.size() - 1 - i;
      try {
        results[layer] = run(*states_[layer]);
      } catch (const std::exception& e) {
        results[layer] = fail(ErrorCode::kOutOfMemory, e.what());
      }
    }
  };
  const std::size_t threads =
      std::min(static_cast<std::size_t>(scan_.options().threads), states_.size());
  std::vector<std::thread> helpers;
  for (std::size_t t = 1; t < threads; ++t) helpers.emplace_back(work);
  work();
  for (std::thread& helper : helpers) helper.join();
  for (Status& result : results) {
    if (!result) return std::move(result);
  }
  return {};
}

}  // namespace relit::bake
