// SPDX-License-Identifier: MIT
// Records that contradict each other.
#include <algorithm>

#include "container/base/limits.hpp"
#include "container/record_codec.hpp"
#include "tests/conformance/making.hpp"

namespace relit::conformance {

using namespace container;

namespace {

/// `consequence`: what else shows when the contents are decoded all the same.
void broken(Vectors& vectors, const char* name, const char* description,
            std::function<void(Draft&)> change, const char* consequence = nullptr) {
  from_static_draft(vectors, name, description, "REF_INVALID", std::move(change));
  if (consequence != nullptr) vectors.back().findings.push_back(consequence);
}

void add_ids(Vectors& vectors) {
  broken(vectors, "twice-clip", "two clips of one id",
         [](Draft& d) { d.clips.push_back(d.clips[0]); });
  broken(vectors, "twice-image", "two images of one id",
         [](Draft& d) { d.images.push_back(d.images[0]); });
  broken(vectors, "twice-material", "two materials of one id",
         [](Draft& d) { d.materials.push_back(d.materials[0]); });
  broken(vectors, "twice-mesh", "two meshes of one id",
         [](Draft& d) { d.meshes.push_back(d.meshes[0]); });
  broken(vectors, "twice-model", "two models of one id",
         [](Draft& d) { d.models.push_back(d.models[0]); });
  broken(vectors, "twice-layer", "two layers of one id", [](Draft& d) {
    d.layers.push_back(d.layers[0]);
    d.layers[1].mantissa_track = 77;
  });
  broken(vectors, "twice-track", "a track of two users", [](Draft& d) {
    d.layers.push_back(d.layers[0]);
    d.layers[1].id = 77;
  });
  broken(vectors, "twice-pose", "two pose tracks of one clip", [](Draft& d) {
    d.poses.push_back(d.poses[0]);
    d.poses[1].track_id = 77;
  });
  broken(vectors, "image-id", "an image of id 2^31", [](Draft& d) {
    d.images[0].id = 0x80000000;
    d.materials[0].image_id = -1;
  });
}

void add_dangling(Vectors& vectors) {
  broken(vectors, "no-image", "a material of an image that is not there",
         [](Draft& d) { d.materials[0].image_id = 5; });
  broken(vectors, "no-material", "a mesh of a material that is not there",
         [](Draft& d) { d.meshes[0].material_id = 5; });
  broken(vectors, "no-clip-of-pose", "a pose of a clip that is not there",
         [](Draft& d) { d.poses[0].clip_id = 5; });
  broken(vectors, "no-clip-of-model", "a model of a clip that is not there",
         [](Draft& d) { d.models[0].clip_id = 5; });
  broken(vectors, "no-model", "a layer of a model that is not there",
         [](Draft& d) { d.layers[0].model_id = 5; });
  broken(
      vectors, "no-node-of-rest", "a rest of a node that is not there",
      [](Draft& d) { d.poses[0].rest[0].node = 2; }, "DECODE_POSE_TRACK");
  broken(
      vectors, "no-node-of-channel", "a channel of a node that is not there",
      [](Draft& d) { d.poses[0].channels[0].index = 2; }, "DECODE_POSE_TRACK");
  broken(
      vectors, "no-morph-weight", "a channel of a morph weight that is not there",
      [](Draft& d) { d.poses[0].channels[0].target = ChannelTarget::kMorphWeight; },
      "DECODE_POSE_TRACK");
  broken(
      vectors, "no-mesh", "a range of a mesh that is not there",
      [](Draft& d) {
        d.poses[0] = {d.poses[0].track_id, d.poses[0].clip_id, PoseKind::kVertices, {}, {},
                      {{5, {}, {1, 1, 1}}}};
      },
      "DECODE_POSE_TRACK");
  broken(
      vectors, "no-palette", "a mesh of joints without a palette",
      [](Draft& d) { d.skeleton->palette.clear(); }, "DECODE_MESH");
  broken(
      vectors, "no-weights-of-targets", "more morph targets than weights",
      [](Draft& d) {
        d.meshes[0].morph_targets = {{{1, 1, 1}, {1}}};
      },
      "DECODE_MESH");
  broken(vectors, "plane-size", "a plane that is smaller than its light map",
         [](Draft& d) { d.layers[0].planes[0].mantissa_rect.width = 15; });
  broken(vectors, "matrix-beyond-order", "an entry for a coefficient beyond the model's order",
         [](Draft& d) { d.layers[0].planes[0].matrix[0].coefficient = 1; });
  broken(vectors, "prediction-beyond-planes", "a prediction from a plane that is not there",
         [](Draft& d) { d.models[0].prediction_plane = 7; });
  from_static_draft(vectors, "video-samples-limit",
                    "more samples of video than any machine decodes", "REF_LIMIT",
                    [](Draft& d) { d.clips[0].tick_rate.num = 0x7FFFFFFF; });
  // What one mesh may have, too often. The streams hold less, which a decoder would also see.
  const auto meshes = [&](const char* name, const char* description, std::uint32_t count,
                          const std::function<void(MeshRecord&)>& enlarge) {
    from_static_draft(vectors, name, description, "REF_LIMIT", [=](Draft& d) {
      enlarge(d.meshes[0]);
      const auto targets = static_cast<std::uint32_t>(d.meshes[0].morph_targets.size());
      d.skeleton->morph_weight_count = std::max(d.skeleton->morph_weight_count, targets);
      for (std::uint32_t id = 1; id < count; ++id) {
        d.meshes.push_back(d.meshes[0]);
        d.meshes.back().id = 1000 + id;
      }
    });
    vectors.back().findings.push_back("DECODE_MESH");
  };
  meshes("meshes-vertices-limit", "more than 2^22 vertices in all", 65,
         [](MeshRecord& m) { m.vertex_count = limits::kVerticesPerMesh; });
  meshes("meshes-indices-limit", "more than 2^25 indices in all", 11,
         [](MeshRecord& m) { m.index_count = limits::kIndicesPerMesh; });
  meshes("meshes-morphs-limit", "more than 2^26 morph offsets in all", 2, [](MeshRecord& m) {
    m.vertex_count = limits::kVerticesPerMesh;
    m.morph_targets.assign(limits::kMorphTargets / 2 + 1, {{1, 1, 1}, {1}});
  });
}

void add_order(Vectors& vectors) {
  const auto swapped = [](RecordType a, RecordType b) {
    return [a, b](std::vector<Piece>& p) { std::swap(p[find_piece(p, a)], p[find_piece(p, b)]); };
  };
  from_pieces(vectors, "order-head-second", "CLIP before HEAD",
              refused({"ORDER_HEAD", "ORDER_RECORD", "COPY_ORDER"}),
              swapped(types::kHeader, types::kClip));
  from_pieces(vectors, "order-mesh-before-material", "MESH before MATL",
              refused({"ORDER_RECORD", "REF_INVALID", "COPY_ORDER"}),
              swapped(types::kMaterial, types::kMesh));
  from_pieces(vectors, "order-two-skeletons", "SKEL twice", faulty({"ORDER_RECORD", "COPY_ORDER"}),
              [](std::vector<Piece>& p) {
                const std::size_t at = find_piece(p, types::kSkeleton);
                p.insert(p.begin() + static_cast<std::ptrdiff_t>(at), Piece(p[at]));
              });
  from_pieces(vectors, "order-late-layer", "LAYR behind a segment",
              lossy({"ORDER_RECORD", "COPY_ORDER"}), [](std::vector<Piece>& p) {
                const Piece layer = p[find_piece(p, types::kLayer)];
                const std::size_t at = find_piece(p, types::kSegment, 1);
                p.insert(p.begin() + static_cast<std::ptrdiff_t>(at), layer);
              });
  from_draft(vectors, "order-no-clip", "a file without clip",
             refused({"ORDER_NO_CLIP", "FEND_MISSING"}),
             [](Draft& d) { d = Draft(), d.copies = d.index = d.end = false; });
  from_pieces(vectors, "chunk-stray", "a chunk that no segment announces", lossy({"CHNK_STRAY"}),
              [](std::vector<Piece>& p) {
                const Piece chunk = p[find_piece(p, types::kChunk)];
                const std::size_t at = find_piece(p, types::kSegment);
                p.insert(p.begin() + static_cast<std::ptrdiff_t>(at), chunk);
              });
  from_pieces(vectors, "chunk-swapped", "chunks in another order than announced",
              lossy({"CHNK_ANNOUNCED", "CHNK_STRAY"}), [](std::vector<Piece>& p) {
                std::swap(p[find_piece(p, types::kChunk)], p[find_piece(p, types::kChunk, 1)]);
              });
  from_pieces(vectors, "chunk-missing", "an announced chunk is missing", lossy({"CHNK_ANNOUNCED"}),
              [](std::vector<Piece>& p) {
                p.erase(p.begin() + static_cast<std::ptrdiff_t>(find_piece(p, types::kChunk, 1)));
              });
  from_pieces(vectors, "chunk-of-other-segment", "a chunk that names another segment",
              lossy({"CHNK_ANNOUNCED"}), [](std::vector<Piece>& p) {
                put_u32(p[find_piece(p, types::kChunk, 2)].payload, 4, 0);
              });
}

void add_segments(Vectors& vectors) {
  from_draft(vectors, "segment-index-gap", "numbers of segments are left out",
             noted({"SEGM_INDEX_GAP"}), [](Draft& d) { d.segments[1].record.index = 5; });
  from_draft(vectors, "segment-index-falls", "a number that does not rise",
             lossy({"SEGM_INDEX", "INDX_CORRUPT"}),
             [](Draft& d) { d.segments[1].record.index = 0; });
  from_draft(vectors, "segment-clip", "a segment of a clip that is not there",
             faulty({"SEGM_CLIP", "CLIP_INCOMPLETE"}),
             [](Draft& d) { d.segments[1].record.clip_id = 9; });
  from_draft(vectors, "segment-frames", "frames beyond the end of the clip",
             faulty({"SEGM_FRAMES"}),
             [](Draft& d) { d.clips[0].frame_count = d.clips[0].duration_ticks = 2; });
  from_draft(vectors, "segment-frames-uneven", "likewise where frames are not evenly spaced",
             faulty({"SEGM_FRAMES", "SEGM_DURATION"}), [](Draft& d) {
               d.clips[0].frame_count = 2;
               d.clips[0].duration_ticks = 10;
             });
  from_draft(vectors, "segment-ticks", "a first tick that is not that of the frames before",
             faulty({"SEGM_TICKS", "SEGM_DURATION"}),
             [](Draft& d) { d.segments[1].record.first_tick = 1; });
  from_draft(vectors, "segment-durations", "durations that do not add up to the clip's",
             faulty({"SEGM_DURATION"}), [](Draft& d) { d.clips[0].duration_ticks = 10; });
  from_draft(vectors, "segment-overlap", "segments that share a frame", faulty({"SEGM_OVERLAP"}),
             [](Draft& d) {
               d.segments[1] = d.segments[0];
               d.segments[1].record.index = 1;
               d.clips[0].frame_count = d.clips[0].duration_ticks = 2;
             });
  FigureOptions four = plain_figure();
  four.frames = 4;
  // Other frames in the place of those of the first segment.
  const auto again = [](Draft& d, std::uint64_t first_frame) {
    DraftSegment& segment = d.segments[1];
    for (ChunkRecord& chunk : segment.chunks)
      for (Packet& packet : chunk.packets)
        packet.pts += static_cast<std::int64_t>(first_frame) -
                      static_cast<std::int64_t>(segment.record.first_frame);
    segment.record.first_frame = segment.record.first_tick = first_frame;
    d.clips[0].frame_count = d.clips[0].duration_ticks = first_frame + 2;
  };
  from_draft(
      vectors, "segment-again",
      "of two segments that begin with the same frame the later one counts",
      faulty({"SEGM_OVERLAP"}), [again](Draft& d) { again(d, 0); }, four);
  from_draft(
      vectors, "segment-overlap-inside", "a segment that begins inside another one is dropped",
      faulty({"SEGM_OVERLAP"}), [again](Draft& d) { again(d, 1); }, four);
  add(vectors, "segment-again-lost",
      "a segment that begins with the same frame, its planes lost: those of the earlier one stay",
      lossy({"SEGM_OVERLAP", "FRAMING_PAYLOAD_CRC"}), [again, four] {
        Draft draft = figure(four);
        again(draft, 0);
        Bytes bytes = assemble(draft);
        bytes.at(offset_of(bytes, types::kChunk, 3) + kRecordHeaderBytes + 30) ^= 1;
        return bytes;
      });
  from_draft(
      vectors, "segment-gap", "a segment in the middle is missing", noted({"SEGM_GAP"}),
      [](Draft& d) { d.segments.erase(d.segments.begin() + 1), d.segments[1].record.index = 1; },
      [] {
        FigureOptions o = plain_figure();
        o.frames = 5;
        return o;
      }());
  from_draft(vectors, "segments-end-early", "the clip's last segment is missing",
             noted({"CLIP_INCOMPLETE"}), [](Draft& d) { d.segments.pop_back(); });
  from_draft(vectors, "track-missing", "a segment without one of its tracks",
             noted({"SEGM_MISSING_TRACK"}), [](Draft& d) { d.segments[1].chunks.pop_back(); });
  from_draft(vectors, "track-unknown", "a chunk of a track that no record declares",
             noted({"SEGM_UNKNOWN_TRACK"}), [](Draft& d) {
               ChunkRecord chunk = d.segments[0].chunks[1];
               chunk.track_id = 99;
               d.segments[0].chunks.push_back(chunk);
             });
  from_draft(vectors, "track-order", "chunks in another order than declared",
             noted({"SEGM_CHUNK_ORDER"}),
             [](Draft& d) { std::swap(d.segments[0].chunks[0], d.segments[0].chunks[1]); });
  from_draft(vectors, "packet-key", "a first packet that is no key", lossy({"CHNK_KEY"}),
             [](Draft& d) { d.segments[0].chunks[1].packets[0].key = false; });
  from_draft(vectors, "packet-outside", "a packet of a frame that is not the segment's",
             lossy({"CHNK_PTS"}), [](Draft& d) { d.segments[0].chunks[1].packets[1].pts = 2; });
  from_draft(vectors, "packet-first-frame", "a first packet that is not of the first frame",
             lossy({"CHNK_PTS"}), [](Draft& d) { d.segments[1].chunks[1].packets[0].pts = 1; });
  from_draft(vectors, "packet-twice", "two packets of one frame", lossy({"CHNK_CORRUPT"}),
             [](Draft& d) { d.segments[0].chunks[1].packets[1].pts = 0; });
  from_draft(vectors, "packets-of-pose", "two packets of a pose in one segment",
             faulty({"CHNK_POSE_PACKETS"}), [](Draft& d) {
               ChunkRecord& pose = d.segments[0].chunks[0];
               const auto size = pose.packets[0].size;
               pose.packets.push_back({1, true, size, size});
               pose.data.insert(pose.data.end(), pose.data.begin(),
                                pose.data.begin() + static_cast<std::ptrdiff_t>(size));
             });
}

void add_copies_and_index(Vectors& vectors) {
  from_pieces(
      vectors, "copy-without-original", "a copy of a type that has no original",
      faulty({"COPY_WITHOUT_ORIGINAL", "COPY_ORDER"}), [](std::vector<Piece>& p) {
        Piece copy = p[find_piece(p, types::kSkeleton, 1)];
        p.erase(p.begin() + static_cast<std::ptrdiff_t>(find_piece(p, types::kSkeleton, 1)));
        p.insert(p.begin() + static_cast<std::ptrdiff_t>(find_piece(p, types::kMaterial)), copy);
      });
  from_pieces(vectors, "copy-different", "a copy that is not what it copies",
              faulty({"COPY_DIFFERENT", "COPY_ORDER"}), [](std::vector<Piece>& p) {
                p[find_piece(p, types::kSkeleton, 1)].payload[12] ^= 1;
              });
  from_pieces(vectors, "copy-order", "copies in another order", noted({"COPY_ORDER"}),
              [](std::vector<Piece>& p) {
                std::swap(p[find_piece(p, types::kMesh, 1)], p[find_piece(p, types::kSkeleton, 1)]);
              });
  from_pieces(vectors, "copy-incomplete", "not all static records have copies",
              noted({"COPY_ORDER"}), [](std::vector<Piece>& p) {
                p.erase(p.begin() + static_cast<std::ptrdiff_t>(find_piece(p, types::kMesh, 1)));
              });
  from_pieces(vectors, "copies-between-segments", "copies between segments, as in a live stream",
              whole(), [](std::vector<Piece>& p) {
                std::vector<Piece> copies;
                const std::size_t at = find_piece(p, types::kSegment);
                for (std::size_t i = 0; i < at; ++i)
                  copies.push_back({p[i].type, p[i].payload, flags::kCopy});
                p.insert(p.begin() + static_cast<std::ptrdiff_t>(find_piece(p, types::kSegment, 1)),
                         copies.begin(), copies.end());
              });
  from_pieces(vectors, "copy-of-index", "a copy of INDX", whole(), [](std::vector<Piece>& p) {
    const Bytes file = assemble(p);
    const std::size_t at = find_piece(p, types::kIndex);
    const auto begin = file.begin() + static_cast<std::ptrdiff_t>(offset_of(file, types::kIndex) +
                                                                  kRecordHeaderBytes);
    const Bytes payload(begin, begin + 8 + 2 * 40);
    p.insert(p.begin() + static_cast<std::ptrdiff_t>(at + 1),
             {types::kIndex, payload, flags::kCopy});
  });
  const auto entry = [](std::size_t at, std::uint8_t bits) {
    return [at, bits](std::vector<Piece>& p) {
      const Bytes file = assemble(p);
      Piece& piece = p[find_piece(p, types::kIndex)];
      const auto begin = file.begin() + static_cast<std::ptrdiff_t>(offset_of(file, types::kIndex) +
                                                                    kRecordHeaderBytes);
      piece = {types::kIndex, Bytes(begin, begin + 8 + 2 * 40)};
      piece.payload[at] ^= bits;
    };
  };
  from_pieces(vectors, "index-entry-offset", "an entry that leads elsewhere",
              faulty({"INDX_ENTRY", "INDX_SEGMENT"}), entry(8 + 40 + 32, 8));
  from_pieces(vectors, "index-entry-frames", "an entry of another first frame",
              faulty({"INDX_ENTRY"}), entry(8 + 40 + 8, 1));
  from_pieces(vectors, "index-short", "a segment is not in the index", faulty({"INDX_SEGMENT"}),
              [](std::vector<Piece>& p) {
                const std::size_t at = find_piece(p, types::kIndex);
                const auto first = parse_segment(p[find_piece(p, types::kSegment)].payload);
                IndexRecord index;
                index.segments = {{first->index, first->clip_id, first->first_frame,
                                   first->frame_count, offset_of(assemble(p), types::kSegment), 0}};
                p[at] = {types::kIndex, serialize(index)};
              });
}

}  // namespace

void add_references(Vectors& vectors) {
  add_ids(vectors);
  add_dangling(vectors);
  add_order(vectors);
  add_segments(vectors);
  add_copies_and_index(vectors);
}

}  // namespace relit::conformance
