// SPDX-License-Identifier: MIT
// What the validator finds in files that break one rule each. Every case takes the shipped clip
// apart, changes something, and puts it together again with all checksums and offsets right.
#include "player/validator.hpp"

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/player/validator_files.hpp"

using namespace relit;
using namespace relit::container;
using namespace relit::player;
using namespace relit::player::test;

namespace {

using Clip = ClipRecord;
using Segment = SegmentRecord;
using Layer = LayerRecord;

}  // namespace

TEST_CASE("validator finds nothing in the shipped clip, whatever it is read from") {
  const Bytes file = join(base());
  const ValidationReport report = examine(file, true);
  INFO(list(report));
  CHECK(report.findings.empty());
  CHECK(report.valid());
}

TEST_CASE("validator's table and VALIDATION.md list the same findings") {
  const Bytes bytes = read_bytes(source_dir() / "container/VALIDATION.md");
  std::istringstream document(std::string(bytes.begin(), bytes.end()));
  std::vector<std::string> rows;
  for (std::string line; std::getline(document, line);)
    if (line.rfind("| `", 0) == 0 && std::isupper(static_cast<unsigned char>(line[3])) != 0)
      rows.push_back(line);
  const auto kinds = finding_kinds();
  REQUIRE(rows.size() == kinds.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string expected = "| `" + std::string(kinds[i].id) + "` | " +
                                 std::string(severity_name(kinds[i].severity)) + " | " +
                                 std::string(kinds[i].meaning) + " | ";
    CHECK(rows[i].substr(0, expected.size()) == expected);
  }
}

TEST_CASE("validator finds damaged framing") {
  const Bytes good = join(base());
  const auto changed = [&](std::size_t at, std::uint8_t with) {
    Bytes file = good;
    file[at] ^= with;
    return file;
  };
  check({"FRAMING_SIGNATURE", {}}, changed(5, 8));
  check({"FRAMING_SIGNATURE", {}}, Bytes{'t', 'e', 'x', 't'});
  check({"FRAMING_SIGNATURE", {}}, Bytes(5000, 'x'));
  check({"FRAMING_SIGNATURE", {}}, {});
  Pieces pieces = base();
  const std::uint64_t clip = 8 + record_bytes(pieces[0].payload.size());
  check({"FRAMING_HEADER_CRC", {}}, changed(clip + 9, 1));
  check({"FRAMING_PAYLOAD_CRC", {}}, changed(clip + 24, 1));
  check({"FRAMING_TRUNCATED", {}, false, false}, Bytes(good.begin(), good.begin() + 200000));
  REQUIRE(padding_after(pieces[1].payload.size()) > 0);
  check({"FRAMING_PADDING", {}}, changed(clip + 24 + pieces[1].payload.size(), 1));
  Bytes longer = good;
  longer.resize(good.size() + 8);
  check({"ORDER_BEHIND_END", {}, false, true}, longer);

  const auto with_header = [&](RecordHeader header) {
    Bytes file = good;
    const auto bytes = encode_header(header);
    std::copy(bytes.begin(), bytes.end(), file.begin() + static_cast<std::ptrdiff_t>(clip));
    return file;
  };
  check({"FRAMING_TYPE", {}}, with_header({record_type("CLiP"), 0, 8, 0}));
  check({"FRAMING_LENGTH", {}}, with_header({types::kClip, 0, std::uint64_t{1} << 63, 0}));
}

TEST_CASE("validator finds records out of order, unknown ones and undefined flags") {
  check_linked({
      {"ORDER_HEAD", [](Pieces& p) { drop(p, 0); }, false, false},
      {"ORDER_RECORD", [](Pieces& p) { std::swap(get(p, "IMAG"), get(p, "MATL")); }, false, false},
      {"ORDER_RECORD", [](Pieces& p) { insert(p, find(p, "SKEL"), get(p, "SKEL")); }, false, false},
      {"ORDER_NO_CLIP", [](Pieces& p) { p.resize(1); }, false, false},
      {"FRAMING_CRITICAL_TYPE",
       [](Pieces& p) {
         insert(p, 1, {record_type("PLAN"), 0, {1}});
       }},
      {"FRAMING_CRITICAL_FLAG", [](Pieces& p) { get(p, "SEGM").flags = 1; }, false, false},
      {"FRAMING_UNDEFINED_FLAG", [](Pieces& p) { get(p, "CLIP").flags = 1u << 16; }},
      {"FRAMING_UNKNOWN_RECORD",
       [](Pieces& p) {
         insert(p, 1, {record_type("nOTE"), 0, {1}});
       }},
      {"FRAMING_PRIVATE_RECORD",
       [](Pieces& p) {
         insert(p, 1, {record_type("noTE"), 0, {}});
       }},
      {"CHNK_ANNOUNCED",
       [](Pieces& p) {
         insert(p, find(p, "CHNK", 1), {record_type("noTE"), 0, {}});
       },
       false, false},
      {"CHNK_STRAY", [](Pieces& p) { insert(p, find(p, "SEGM", 1), get(p, "CHNK")); }},
      {"FEND_MISSING", [](Pieces& p) { p.pop_back(); }},
  });
}

TEST_CASE("validator finds fields that break rules, exceed limits or are of later versions") {
  const std::string endless(5000, 'x');
  check_linked({
      {"HEAD_VERSION", [](Pieces& p) { poke(p[0], 0, {1}); }, false, false},
      {"HEAD_VERSION", [](Pieces& p) { poke(p[0], 2, {1}); }, false, false},
      {"HEAD_NEWER_MINOR", [](Pieces& p) { poke(p[0], 2, {200}); }, false, false},
      {"HEAD_CORRUPT", [](Pieces& p) { poke(p[0], 4, {1}); }, false, false},
      {"HEAD_LIMIT",
       [&](Pieces& p) {
         edit<HeaderRecord>(p, "HEAD", parse_header, [&](auto& r) { r.writer = endless; });
       }},
      {"CLIP_CORRUPT",
       [](Pieces& p) {
         edit<Clip>(p, "CLIP", parse_clip, [](auto& r) { r.bounds_max[1] = -1e9f; });
       }},
      {"CLIP_LIMIT",
       [](Pieces& p) {
         edit<Clip>(p, "CLIP", parse_clip, [](auto& r) { r.frame_count = 1ull << 40; });
       }},
      {"IMAG_CORRUPT",
       [](Pieces& p) {
         edit<ImageRecord>(p, "IMAG", parse_image, [](auto& r) { r.bytes.clear(); });
       }},
      {"IMAG_LIMIT",
       [&](Pieces& p) {
         edit<ImageRecord>(p, "IMAG", parse_image, [&](auto& r) { r.media_type = endless; });
       }},
      {"IMAG_UNSUPPORTED",
       [](Pieces& p) {
         edit<ImageRecord>(p, "IMAG", parse_image, [](auto& r) { r.media_type = "image/webp"; });
       }},
      {"MATL_CORRUPT",
       [](Pieces& p) {
         edit<MaterialRecord>(p, "MATL", parse_material, [](auto& r) { r.base_color[0] = 2; });
       }},
      {"MATL_LIMIT",
       [&](Pieces& p) {
         edit<MaterialRecord>(p, "MATL", parse_material, [&](auto& r) { r.name = endless; });
       }},
      {"MATL_UNSUPPORTED",
       [](Pieces& p) {
         edit<MaterialRecord>(p, "MATL", parse_material, [](auto& r) { r.wrap_u = Wrap{3}; });
       }},
      {"MESH_CORRUPT",
       [](Pieces& p) {
         edit<MeshRecord>(p, "MESH", parse_mesh, [](auto& r) { ++r.index_count; });
       }},
      {"MESH_LIMIT",
       [](Pieces& p) {
         edit<MeshRecord>(p, "MESH", parse_mesh, [](auto& r) { r.vertex_count = 65536; });
       }},
      {"MESH_UNSUPPORTED",
       [](Pieces& p) {
         edit<MeshRecord>(p, "MESH", parse_mesh,
                          [](auto& r) { r.streams[0].semantic = Semantic{8}; });
       }},
      {"SKEL_CORRUPT",
       [](Pieces& p) {
         edit<SkeletonRecord>(p, "SKEL", parse_skeleton, [](auto& r) { r.nodes[0].parent = 0; });
       }},
      {"SKEL_LIMIT",
       [](Pieces& p) {
         edit<SkeletonRecord>(p, "SKEL", parse_skeleton,
                              [](auto& r) { r.morph_weight_count = 65536; });
       }},
      {"POSE_CORRUPT",
       [](Pieces& p) {
         edit<PoseTrackRecord>(p, "POSE", parse_pose_track,
                               [](auto& r) { r.channels[1] = r.channels[0]; });
       }},
      {"POSE_LIMIT",
       [](Pieces& p) {
         poke(get(p, "POSE"), 9, {0, 0, 1, 0});
       },
       false, false},
      {"POSE_UNSUPPORTED", [](Pieces& p) { poke(get(p, "POSE"), 8, {2}); }, false, false},
      {"MODL_CORRUPT",
       [](Pieces& p) {
         edit<ModelRecord>(p, "MODL", parse_model, [](auto& r) { r.mean.pop_back(); });
       }},
      {"MODL_LIMIT",
       [](Pieces& p) { edit<ModelRecord>(p, "MODL", parse_model, [](auto& r) { r.order = 4; }); }},
      {"MODL_UNSUPPORTED",
       [](Pieces& p) {
         edit<ModelRecord>(p, "MODL", parse_model,
                           [](auto& r) { r.kind = container::ModelKind{1}; });
       }},
      {"LAYR_CORRUPT",
       [](Pieces& p) { edit<Layer>(p, "LAYR", parse_layer, [](auto& r) { r.bit_depth = 9; }); }},
      {"LAYR_LIMIT",
       [](Pieces& p) {
         edit<Layer>(p, "LAYR", parse_layer, [](auto& r) { r.coded_width = 20000; });
       }},
      {"LAYR_UNSUPPORTED",
       [](Pieces& p) {
         edit<Layer>(p, "LAYR", parse_layer, [](auto& r) { r.chroma = Chroma{3}; });
       }},
      {"REF_INVALID",
       [](Pieces& p) {
         edit<MaterialRecord>(p, "MATL", parse_material, [](auto& r) { r.image_id = 77; });
       }},
      {"REF_LIMIT",
       [](Pieces& p) {
         edit<Clip>(p, "CLIP", parse_clip, [](auto& r) { r.tick_rate = {1 << 30, 1}; });
       }},
      {"SEGM_CORRUPT", [](Pieces& p) { poke(get(p, "SEGM"), 0, {0}); }, false, false},
      {"SEGM_LIMIT",
       [](Pieces& p) {
         poke(get(p, "SEGM"), 32, {0xFF, 0xFF, 0xFF});
       },
       false, false},
      {"CHNK_CORRUPT", [](Pieces& p) { get(p, "CHNK").payload.push_back(0); }},
      {"CHNK_LIMIT",
       [](Pieces& p) {
         poke(get(p, "CHNK"), 16, {0, 0, 0, 64});
       }},
      {"INDX_CORRUPT", [](Pieces& p) { poke(get(p, "INDX"), 4, {1}); }},
      {"INDX_LIMIT",
       [](Pieces& p) {
         poke(get(p, "INDX"), 0, {0, 0, 0, 64});
       }},
  });
}

TEST_CASE("validator finds segments and chunks that do not fit") {
  const auto segment = [](const std::function<void(Segment&)>& change) {
    return [change](Pieces& p) { edit<Segment>(p, "SEGM", parse_segment, change, 1); };
  };
  const auto chunk = [](const std::function<void(ChunkRecord&)>& change) {
    return [change](Pieces& p) { edit<ChunkRecord>(p, "CHNK", parse_chunk, change, 1); };
  };
  check_linked({
      {"SEGM_INDEX", segment([](auto& r) { r.index = 0; }), false, false},
      {"SEGM_INDEX_GAP", segment([](auto& r) { r.index = 2; }), false, false},
      {"SEGM_CLIP", segment([](auto& r) { r.clip_id = 9; }), false, false},
      {"SEGM_FRAMES", segment([](auto& r) { r.frame_count = 60000; }), false, false},
      {"SEGM_OVERLAP", segment([](auto& r) { r.first_frame = 0; }), false, false},
      {"SEGM_GAP", segment([](auto& r) { ++r.first_frame, --r.frame_count; }), false, false},
      {"SEGM_TICKS", segment([](auto& r) { --r.first_tick; }), false, false},
      {"SEGM_DURATION",
       [](Pieces& p) { edit<Clip>(p, "CLIP", parse_clip, [](auto& r) { ++r.duration_ticks; }); }},
      {"SEGM_MISSING_TRACK",
       [](Pieces& p) {
         edit<Segment>(p, "SEGM", parse_segment, [](auto& r) { r.chunks.erase(r.chunks.begin()); });
         drop(p, find(p, "CHNK"));
       }},
      {"SEGM_UNKNOWN_TRACK", segment([](auto& r) { r.chunks[0].track_id = 99; }), false, false},
      {"SEGM_CHUNK_ORDER",
       [](Pieces& p) {
         edit<Segment>(p, "SEGM", parse_segment,
                       [](auto& r) { std::swap(r.chunks[0], r.chunks[1]); });
         std::swap(get(p, "CHNK"), get(p, "CHNK", 1));
       }},
      {"CHNK_ANNOUNCED", chunk([](auto& r) { r.track_id = 77; })},
      {"CHNK_ANNOUNCED", chunk([](auto& r) { r.segment_index = 1; })},
      {"CHNK_KEY", chunk([](auto& r) { r.packets[0].key = false; })},
      {"CHNK_PTS", chunk([](auto& r) { r.packets.back().pts = 4000; })},
      {"CHNK_POSE_PACKETS",
       [](Pieces& p) {
         edit<ChunkRecord>(p, "CHNK", parse_chunk, [](auto& r) {
           r.packets.push_back({1, false, r.data.size(), 0});
         });
       },
       true},
      {"CLIP_INCOMPLETE",
       [](Pieces& p) {
         p.erase(p.begin() + static_cast<std::ptrdiff_t>(find(p, "SEGM", 1)),
                 p.begin() + static_cast<std::ptrdiff_t>(find(p, "HEAD", 1)));
         edit<IndexRecord>(p, "INDX", parse_index, [](auto& r) { r.segments.resize(1); });
       }},
  });
}

TEST_CASE("validator compares copies, index and end with the file") {
  check_linked({
      {"COPY_WITHOUT_ORIGINAL", [](Pieces& p) { drop(p, find(p, "SKEL")); }, false, false},
      {"COPY_DIFFERENT", [](Pieces& p) { get(p, "CLIP", 1).payload[8] ^= 1; }, false, false},
      {"COPY_ORDER", [](Pieces& p) { drop(p, find(p, "HEAD", 1)); }},
      {"COPY_MISSING",
       [](Pieces& p) {
         std::erase_if(p, [](const Piece& piece) { return piece.flags == flags::kCopy; });
       }},
      {"INDX_SEGMENT",
       [](Pieces& p) {
         edit<IndexRecord>(p, "INDX", parse_index,
                           [](auto& r) { r.segments.erase(r.segments.begin() + 1); });
       }},
      {"INDX_ENTRY",
       [](Pieces& p) {
         edit<IndexRecord>(p, "INDX", parse_index, [](auto& r) { ++r.segments[1].frame_count; });
       }},
      {"INDX_MISSING", [](Pieces& p) { drop(p, find(p, "INDX")); }},
  });
  // What relink() would set right again.
  const auto end = [](const std::function<void(EndRecord&)>& change) {
    Pieces pieces = base();
    edit<EndRecord>(pieces, "FEND", parse_end, change);
    return join(pieces);
  };
  check({"FEND_INDEX_OFFSET", {}}, end([](auto& r) { r.index_offset = 0; }));
  check({"FEND_COPIES_OFFSET", {}}, end([](auto& r) { r.copies_offset += 8; }));
  check({"FEND_FILE_BYTES", {}}, end([](auto& r) { r.file_bytes += 8; }));
  check({"FEND_CORRUPT", {}}, end([](auto& r) { r.file_bytes += 1; }));
  Pieces pieces = base();
  edit<IndexRecord>(pieces, "INDX", parse_index, [](auto& r) { r.segments[1].offset += 8; });
  check({"INDX_ENTRY", {}, false, false}, join(pieces));
}

// VIDEO_EXPONENT and VIDEO_OPEN need streams of exponents, which the shipped clip does without:
// bake_minimal can make them. DECODE_POSE_PACKET is a mode of 3 inside zstd as well.
TEST_CASE("validator decodes every payload") {
  check_linked({
      {"DECODE_IMAGE",
       [](Pieces& p) {
         edit<ImageRecord>(p, "IMAG", parse_image, [](auto& r) { r.bytes.resize(100); });
       },
       true},
      {"DECODE_MESH",
       [](Pieces& p) {
         edit<MeshRecord>(p, "MESH", parse_mesh, [](auto& r) { r.indices.resize(20); });
       },
       true},
      {"DECODE_POSE_TRACK",
       [](Pieces& p) {
         edit<PoseTrackRecord>(p, "POSE", parse_pose_track,
                               [](auto& r) { r.channels[0].offset[0] = 1e10f; });
       },
       true},
      {"DECODE_POSE_PACKET", [](Pieces& p) { get(p, "CHNK").payload.back() ^= 0xFF; }, true},
      {"DECODE_POSE_MATRIX",
       [](Pieces& p) {
         edit<SkeletonRecord>(p, "SKEL", parse_skeleton, [](auto& r) {
           for (auto& entry : r.palette)
             for (float& v : entry.inverse_bind) v = 9e8f;
           for (auto& node : r.nodes)
             for (float& v : node.local) v = 9e8f;
         });
         edit<PoseTrackRecord>(p, "POSE", parse_pose_track, [](auto& r) {
           for (auto& rest : r.rest) rest.scale = {1e9f, 1e9f, 1e9f};
         });
       },
       true},
      {"VIDEO_CODEC",
       [](Pieces& p) { edit<Layer>(p, "LAYR", parse_layer, [](auto& r) { r.codec = "theora"; }); },
       true},
      {"VIDEO_PICTURE",
       [](Pieces& p) {
         edit<ChunkRecord>(
             p, "CHNK", parse_chunk, [](auto& r) { std::ranges::fill(r.data, std::uint8_t{0xFF}); },
             1);
       },
       true},
      {"VIDEO_PICTURES",
       [](Pieces& p) {
         edit<Layer>(p, "LAYR", parse_layer, [](auto& r) { r.mantissa_pictures = 1; });
       },
       true},
      {"VIDEO_TRANSFER",
       [](Pieces& p) {
         edit<Layer>(p, "LAYR", parse_layer, [](auto& r) { r.planes[0].scale *= 10; });
       },
       true},
  });
}

TEST_CASE("validator goes on after damage, and counts what it does not list") {
  Bytes file = join(base());
  const Pieces& pieces = base();
  std::uint64_t at = kSignature.size();
  std::size_t chunks = 0;
  for (const Piece& piece : pieces) {
    if (piece.type == types::kChunk) ++chunks, file[at + kRecordHeaderBytes + 24] ^= 1;
    at += record_bytes(piece.payload.size());
  }
  REQUIRE(chunks > 3);
  const ValidationReport report = examine(file, true, 2);
  INFO(list(report));
  CHECK(report.findings.size() == 2);
  CHECK(report.errors == chunks);
}

TEST_CASE("relit validate answers by exit status, text and JSON") {
  const Folder folder;
  const auto write = [&](const char* name, const Bytes& bytes) {
    std::ofstream(folder.file(name), std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  };
  Pieces pieces = base();
  write("a.relit", join(pieces));
  pieces.pop_back();
  write("b.relit", join(pieces));
  std::string says;
  CHECK(run_relit("validate " + folder.file("a.relit"), &says) == 0);
  CHECK(says == "1 of 1 files valid; 0 errors, 0 warnings\n");
  CHECK(run_relit("validate - <" + folder.file("a.relit")) == 0);
  CHECK(run_relit("validate " + folder.path.string(), &says) == 0);
  CHECK(says.find("b.relit:") != std::string::npos);
  CHECK(says.find(": warning FEND_MISSING: ") != std::string::npos);
  CHECK(run_relit("validate --warnings-as-errors " + folder.path.string()) == 1);
  CHECK(run_relit("validate --json " + folder.path.string(), &says) == 0);
  const auto json = nlohmann::json::parse(says);
  REQUIRE(json["files"].size() == 2);
  CHECK(json["files"][0]["findings"].empty());
  const auto& finding = json["files"][1]["findings"][0];
  CHECK(finding["id"] == "FEND_MISSING");
  CHECK(finding["severity"] == "warning");
  CHECK(finding["record"].is_null());
  CHECK(json["files"][1]["warnings"] == 1);
  write("c.relit", {'n', 'o'});
  CHECK(run_relit("validate " + folder.path.string()) == 1);
  CHECK(run_relit("validate " + folder.file("nothing")) == 1);
  CHECK(run_relit("validate") == 2);
}
