// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "bake_minimal/plane_encoder.hpp"
#include "decoders/plane_decoder.hpp"
#include "decoders/sh.hpp"
#include "tests/test.hpp"

/// Clips, and their way through encoder and decoder, for the tests of the coding.
namespace relit::bake::test {

using Frames = std::vector<std::vector<float>>;

struct Clip {
  TransferShape shape;
  Frames frames;
};

/// Smooth waves that travel, of both signs but for coefficient 0, weaker in higher bands, with some
/// colour, and exactly zero in a rectangle at the lower right.
inline Clip smooth_clip(int order, int width, int height, int frame_count) {
  Clip clip{{order, width, height}, {}};
  for (int f = 0; f < frame_count; ++f) {
    std::vector<float> t;
    for (int n = 0; n < clip.shape.coefficients(); ++n) {
      for (int c = 0; c < 3; ++c) {
        for (int y = 0; y < height; ++y) {
          for (int x = 0; x < width; ++x) {
            const double phase = 0.21 * x + 0.13 * y * (n + 1) / 4.0 + 0.2 * f + 1.7 * n;
            const double wave = std::sin(phase) * (1 + 0.15 * c * std::cos(0.1 * y - 0.1 * f));
            const double value = n == 0 ? 0.14 + 0.1 * wave : 0.2 / n * wave;
            t.push_back(x >= width - 4 && y >= height - 4 ? 0 : static_cast<float>(value));
          }
        }
      }
    }
    clip.frames.push_back(std::move(t));
  }
  return clip;
}

struct Encoded {
  container::ModelRecord model;
  std::vector<container::LayerRecord> layers;
  std::vector<EncodedSegment> segments;
};

inline Result<Encoded> encode(const Clip& clip, const CodingOptions& options,
                              const ModelIds& ids = {7, 3, 10, 20, 0}) {
  RELIT_ASSIGN(RangeScan scan, RangeScan::create(clip.shape, options));
  for (const auto& frame : clip.frames) RELIT_TRY(scan.add_frame({frame}));
  RELIT_ASSIGN(PlaneEncoder encoder, PlaneEncoder::begin(std::move(scan), ids));
  Encoded encoded;
  for (const auto& frame : clip.frames) {
    RELIT_TRY(encoder.encode_frame({frame}));
    while (auto segment = encoder.take_segment()) encoded.segments.push_back(std::move(*segment));
  }
  RELIT_TRY(encoder.finish());
  while (auto segment = encoder.take_segment()) encoded.segments.push_back(std::move(*segment));
  encoded.model = encoder.model();
  encoded.layers = encoder.layers();
  return encoded;
}

inline Result<decoders::PlaneDecoder> decoder_with_all(
    const Encoded& encoded, const decoders::PlaneDecoderOptions& options = {}) {
  RELIT_ASSIGN(decoders::PlaneDecoder decoder,
               decoders::PlaneDecoder::open(encoded.model, encoded.layers, options));
  for (const EncodedSegment& s : encoded.segments) {
    for (const container::ChunkRecord& chunk : s.chunks) {
      RELIT_TRY(decoder.add_chunk(s.segment, chunk));
    }
  }
  return decoder;
}

inline Result<Frames> decode(const Encoded& encoded, std::size_t frame_count, int threads = 1) {
  RELIT_ASSIGN(decoders::PlaneDecoder decoder, decoder_with_all(encoded, {threads, {}}));
  Frames frames;
  decoders::FrameView view;
  for (std::size_t f = 0; f < frame_count; ++f) {
    RELIT_TRY(decoder.frame(f, view));
    const auto coefficients =
        static_cast<std::size_t>(decoders::coefficient_count(encoded.model.order));
    frames.emplace_back(coefficients * 3 * encoded.model.width * encoded.model.height);
    RELIT_TRY(decoders::reconstruct(view.planes(), encoded.model, encoded.layers, frames.back()));
  }
  return frames;
}

/// All bytes that a writer would put into a file, in order.
inline std::vector<std::uint8_t> all_bytes(const Encoded& encoded) {
  std::vector<std::uint8_t> bytes;
  for (const auto& layer : encoded.layers) {
    bytes.insert(bytes.end(), layer.codec_private.begin(), layer.codec_private.end());
    bytes.insert(bytes.end(), layer.exponent_private.begin(), layer.exponent_private.end());
  }
  for (const EncodedSegment& s : encoded.segments) {
    for (const container::ChunkRecord& chunk : s.chunks) {
      for (const container::Packet& p : chunk.packets) {
        bytes.push_back(static_cast<std::uint8_t>(p.pts));
        bytes.push_back(p.key ? 1 : 0);
      }
      bytes.insert(bytes.end(), chunk.data.begin(), chunk.data.end());
    }
  }
  return bytes;
}

inline std::string describe(const CodingOptions& o) {
  return o.codec + (o.lossless ? " lossless" : "") + " bits " +
         std::to_string(o.bit_depth.value_or(0)) + " chroma " +
         (o.chroma ? std::to_string(static_cast<int>(*o.chroma)) : "?") + " block " +
         std::to_string(o.exponent_block) + " hold " + std::to_string(o.exponent_hold) +
         (o.layout == Layout::kGrid ? " grid" : " layered");
}

/// Segments of five frames and fast presets.
inline CodingOptions quick(std::string codec, int bits, container::Chroma chroma, int block,
                           int hold) {
  CodingOptions o;
  o.codec = std::move(codec);
  o.bit_depth = bits;
  o.chroma = chroma;
  o.exponent_block = block;
  o.exponent_hold = hold;
  o.segment_frames = 5;
  if (o.codec == "h264" || o.codec == "hevc") o.preset = "veryfast";
  if (o.codec == "vp9" || o.codec == "av1") o.preset = "8";
  return o;
}

inline Encoded must_encode(const Clip& clip, const CodingOptions& options) {
  auto encoded = encode(clip, options);
  INFO(describe(options));
  INFO((encoded ? "" : encoded.error().message));
  REQUIRE(encoded);
  return std::move(*encoded);
}

}  // namespace relit::bake::test
