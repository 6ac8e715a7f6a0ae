// SPDX-License-Identifier: MIT
// Fields of single records out of their range: layers, segments, chunks, index, end.
#include <limits>

#include "container/base/limits.hpp"
#include "container/record_codec.hpp"
#include "tests/conformance/making.hpp"

namespace relit::conformance {

using namespace container;

namespace {

/// A change of the first layer of a figure with exponents in blocks of 4.
void layer(Vectors& vectors, const char* name, const char* description, const char* finding,
           std::function<void(LayerRecord&)> change) {
  FigureOptions options = plain_figure();
  options.coding.exponent_block = 4;
  from_static_draft(
      vectors, name, description, finding, [change](Draft& d) { change(d.layers[0]); }, options);
}

void add_layer_fields(Vectors& vectors) {
  using L = LayerRecord;
  layer(vectors, "layer-codec-empty", "a codec without name", "LAYR_CORRUPT",
        [](L& l) { l.codec.clear(); });
  layer(vectors, "layer-codec-letters", "a codec in upper case", "LAYR_CORRUPT",
        [](L& l) { l.codec = "FFV1"; });
  layer(vectors, "layer-codec-limit", "a codec's name of 33 bytes", "LAYR_LIMIT",
        [](L& l) { l.codec.assign(33, 'c'); });
  layer(vectors, "layer-no-width", "pictures without width", "LAYR_CORRUPT",
        [](L& l) { l.coded_width = 0; });
  layer(vectors, "layer-width-limit", "pictures 16385 samples wide", "LAYR_LIMIT",
        [](L& l) { l.coded_width = 16385; });
  layer(vectors, "layer-bit-depth", "samples of 9 bits", "LAYR_CORRUPT",
        [](L& l) { l.bit_depth = 9; });
  layer(vectors, "layer-chroma", "an unknown chroma format", "LAYR_UNSUPPORTED",
        [](L& l) { l.chroma = Chroma{3}; });
  layer(vectors, "layer-no-pictures", "a decoder that holds no picture", "LAYR_CORRUPT",
        [](L& l) { l.mantissa_pictures = 0; });
  layer(vectors, "layer-pictures-limit", "a decoder that holds 33 pictures", "LAYR_LIMIT",
        [](L& l) { l.mantissa_pictures = 33; });
  layer(vectors, "layer-one-track", "exponents in the mantissas' track", "LAYR_CORRUPT",
        [](L& l) { l.exponent_track = l.mantissa_track; });
  layer(vectors, "layer-exponent-block", "exponent blocks of 3 texels", "LAYR_CORRUPT",
        [](L& l) { l.exponent_block = 3; });
  layer(vectors, "layer-exponent-block-64", "exponent blocks of 64 texels", "LAYR_CORRUPT",
        [](L& l) { l.exponent_block = 64; });
  layer(vectors, "layer-exponent-rect", "an exponent rectangle of another size", "LAYR_CORRUPT",
        [](L& l) { l.planes[0].exponent_rect.width = 5; });
  layer(vectors, "layer-exponent-rect-outside", "an exponent rectangle outside its picture",
        "LAYR_CORRUPT", [](L& l) { l.planes[0].exponent_rect.x = 14; });
  layer(vectors, "layer-no-planes", "a layer without planes", "LAYR_CORRUPT",
        [](L& l) { l.planes.clear(); });
  layer(vectors, "layer-rect-outside", "a mantissa rectangle outside its picture", "LAYR_CORRUPT",
        [](L& l) { l.planes[0].mantissa_rect.y = 1; });
  layer(vectors, "layer-rect-wraps", "a rectangle whose end overflows 16 bits", "LAYR_CORRUPT",
        [](L& l) { l.planes[0].mantissa_rect.x = 65535; });
  layer(vectors, "layer-overlap", "two planes on the same samples", "LAYR_CORRUPT",
        [](L& l) { l.planes.push_back(l.planes[0]); });
  layer(vectors, "layer-component", "component 1 of luma", "LAYR_CORRUPT",
        [](L& l) { l.planes[0].component = 1; });
  layer(vectors, "layer-scale-zero", "a scale of 0", "LAYR_CORRUPT",
        [](L& l) { l.planes[0].scale = 0; });
  layer(vectors, "layer-scale-nan", "a scale that is no number", "LAYR_CORRUPT",
        [](L& l) { l.planes[0].scale = kNan; });
  layer(vectors, "layer-matrix-twice", "two entries for one coefficient and channel",
        "LAYR_CORRUPT", [](L& l) { l.planes[0].matrix.push_back(l.planes[0].matrix[0]); });
  layer(vectors, "layer-matrix-channel", "channel 3", "LAYR_CORRUPT",
        [](L& l) { l.planes[0].matrix[0].channel = 3; });
  layer(vectors, "layer-matrix-coefficient", "coefficient 16", "LAYR_CORRUPT",
        [](L& l) { l.planes[0].matrix[0].coefficient = 16; });
  FigureOptions odd = plain_figure();
  odd.coding.codec = "mpeg4";
  odd.coding.chroma = Chroma::k420;
  from_static_draft(
      vectors, "layer-odd-corner", "a 4:2:0 chroma plane at an odd sample", "LAYR_CORRUPT",
      [](Draft& d) {
        d.layers[0].coded_width += 2;
        d.layers[0].planes[1].mantissa_rect.x = 1;
      },
      odd);
}

/// A change of all payloads of a type, of which none is static.
void raw(Vectors& vectors, const char* name, const char* description, const char* finding,
         RecordType type, std::function<void(Bytes&)> change) {
  from_pieces(vectors, name, description, lossy({finding}), [type, change](std::vector<Piece>& p) {
    // Index and end record are computed last; here they are written out first.
    if (type == types::kIndex || type == types::kEnd) {
      const Bytes file = assemble(p);
      Piece& piece = p[find_piece(p, type)];
      const auto begin =
          file.begin() + static_cast<std::ptrdiff_t>(offset_of(file, type) + kRecordHeaderBytes);
      const std::size_t bytes = type == types::kEnd ? kEndPayloadBytes : 8 + 40 * 2;
      piece = {type, Bytes(begin, begin + static_cast<std::ptrdiff_t>(bytes))};
    }
    change(p[find_piece(p, type)].payload);
  });
}

void add_segment_fields(Vectors& vectors) {
  raw(vectors, "segment-marker", "another marker", "SEGM_CORRUPT", types::kSegment,
      [](Bytes& b) { b[3] ^= 1; });
  raw(vectors, "segment-index-limit", "segment 2^24", "SEGM_CORRUPT", types::kSegment,
      [](Bytes& b) { put_u32(b, 16, limits::kSegments); });
  raw(vectors, "segment-no-frames", "a segment without frames", "SEGM_CORRUPT", types::kSegment,
      [](Bytes& b) { put_u32(b, 32, 0); });
  raw(vectors, "segment-frames-limit", "65537 frames", "SEGM_LIMIT", types::kSegment,
      [](Bytes& b) { put_u32(b, 32, 65537); });
  raw(vectors, "segment-ticks-limit", "a first tick beyond 2^32", "SEGM_LIMIT", types::kSegment,
      [](Bytes& b) { put_u64(b, 36, (std::uint64_t{1} << 32) + 1); });
  raw(vectors, "segment-chunk-bytes", "a chunk of 25 bytes", "SEGM_CORRUPT", types::kSegment,
      [](Bytes& b) { put_u64(b, 56, 25); });
  raw(vectors, "segment-reserved", "a reserved field that is not 0", "SEGM_CORRUPT",
      types::kSegment, [](Bytes& b) { put_u32(b, 52, 1); });
  raw(vectors, "segment-track-twice", "two chunks of one track", "SEGM_CORRUPT", types::kSegment,
      [](Bytes& b) { put_u32(b, 64, 1); });
  raw(vectors, "segment-duration-zero", "a frame that lasts no tick", "SEGM_CORRUPT",
      types::kSegment, [](Bytes& b) {
        put_u32(b, b.size() - 4, 2);
        b.resize(b.size() + 8);
      });
  raw(vectors, "segment-durations-count", "one duration for two frames", "SEGM_CORRUPT",
      types::kSegment, [](Bytes& b) {
        put_u32(b, b.size() - 4, 1);
        b.resize(b.size() + 4, 1);
      });
}

/// The first chunk of the first segment, the pose's, has one packet: its table is at byte 24.
void add_chunk_fields(Vectors& vectors) {
  raw(vectors, "chunk-first-pts", "a first packet whose pts is not first_pts", "CHNK_CORRUPT",
      types::kChunk, [](Bytes& b) { b[b[24] >= 128 ? 26 : 25] = 2; });
  raw(vectors, "chunk-sizes", "sizes that do not add up to the data", "CHNK_CORRUPT", types::kChunk,
      [](Bytes& b) { b[24] ^= 2; });
  raw(vectors, "chunk-no-packets", "no packet", "CHNK_CORRUPT", types::kChunk,
      [](Bytes& b) { put_u32(b, 16, 0); });
  raw(vectors, "chunk-packets-limit", "131073 packets", "CHNK_LIMIT", types::kChunk,
      [](Bytes& b) { put_u32(b, 16, limits::kPacketsPerChunk + 1); });
  raw(vectors, "chunk-table", "a table longer than the payload", "CHNK_CORRUPT", types::kChunk,
      [](Bytes& b) { put_u32(b, 20, 4096); });
  from_draft(vectors, "chunk-varint", "a size in a longer varint than it needs",
             lossy({"CHNK_CORRUPT"}), [](Draft&) {});
  Vector& padded = vectors.back();
  padded.make = [] {
    Draft draft = figure();
    ChunkRecord& chunk = draft.segments[0].chunks[0];
    // Twenty bytes: their varint of 41 may be written as A9 00.
    chunk.data.resize(20);
    chunk.packets = {{0, true, 0, 20}};
    std::vector<Piece> pieces = pieces_of(draft);
    Piece& piece = pieces[find_piece(pieces, types::kChunk)];
    piece.payload[24] = 0xA9;
    piece.payload.insert(piece.payload.begin() + 25, 0x00);
    put_u32(piece.payload, 20, 3);
    // As long as announced again.
    piece.payload.pop_back();
    return assemble(pieces);
  };
}

void add_index_fields(Vectors& vectors) {
  raw(vectors, "index-reserved", "a reserved field that is not 0", "INDX_CORRUPT", types::kIndex,
      [](Bytes& b) { put_u32(b, 4, 1); });
  raw(vectors, "index-order", "two entries of one segment", "INDX_CORRUPT", types::kIndex,
      [](Bytes& b) { put_u32(b, 48, 0); });
  raw(vectors, "index-offset", "an offset that is no multiple of 8", "INDX_CORRUPT", types::kIndex,
      [](Bytes& b) { b[40] ^= 1; });
  raw(vectors, "index-limit", "2^24 + 1 entries", "INDX_LIMIT", types::kIndex,
      [](Bytes& b) { put_u32(b, 0, limits::kSegments + 1); });
  raw(vectors, "end-file-bytes", "another length of the file", "FEND_FILE_BYTES", types::kEnd,
      [](Bytes& b) { b[16] ^= 8; });
  raw(vectors, "end-file-bytes-odd", "a length of the file that is no multiple of 8",
      "FEND_CORRUPT", types::kEnd, [](Bytes& b) { b[16] ^= 1; });
  raw(vectors, "end-index-offset", "the index is elsewhere", "FEND_INDEX_OFFSET", types::kEnd,
      [](Bytes& b) { b[0] ^= 8; });
  raw(vectors, "end-copies-offset", "the copies are elsewhere", "FEND_COPIES_OFFSET", types::kEnd,
      [](Bytes& b) { b[8] ^= 8; });
  raw(vectors, "end-no-index-offset", "an index that FEND does not know", "FEND_INDEX_OFFSET",
      types::kEnd, [](Bytes& b) { put_u64(b, 0, 0); });
}

}  // namespace

void add_layer_payloads(Vectors& vectors) { add_layer_fields(vectors); }

void add_segment_payloads(Vectors& vectors) {
  add_segment_fields(vectors);
  add_chunk_fields(vectors);
  add_index_fields(vectors);
}

}  // namespace relit::conformance
