// SPDX-License-Identifier: MIT
#include "player/recover_static.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <set>
#include <tuple>

#include "container/record_codec.hpp"
#include "container/references.hpp"
#include "player/rewrite.hpp"

namespace relit::player {
namespace {

using namespace container;

/// What a record is, as its header says even when the payload was hit: copy and original agree.
using Identity = std::tuple<RecordType, std::uint64_t, std::uint32_t>;
Identity identity(const FoundRecord& r) {
  return {r.header.type, r.header.payload_bytes, r.header.payload_crc};
}

/// A static record with its place in the order of the file.
struct Slot {
  FoundRecord record;      ///< the intact one of original and copies, if there is one
  std::int64_t place = 0;  ///< where the original stands, or stood
  bool original_intact = false;
};

const char* kind_name(RecordType type) {
  constexpr std::array<const char*, 9> kNames{"header",   "clip", "image", "material", "mesh",
                                              "skeleton", "pose", "model", "layer"};
  return kNames[static_cast<std::size_t>(order_of(type))];
}

std::string describe(const FoundRecord& r) {
  return std::string("the ") + kind_name(r.header.type) + " of " +
         std::to_string(r.header.payload_bytes) + " bytes at byte " +
         std::to_string(r.offset_bytes);
}

std::string label(const char* what, std::uint32_t id) {
  return std::string(what) + " " + std::to_string(id);
}

/// Where the originals of the copies stood: copies follow one another as the originals did, so one
/// pair tells the distance of its neighbours.
std::vector<std::int64_t> places_of_copies(const Survey& found) {
  std::map<Identity, std::uint64_t> originals;
  for (const FoundRecord& r : found.originals) originals.emplace(identity(r), r.offset_bytes);
  std::map<std::int64_t, std::int64_t> distances;  // by offset of the copy
  for (const FoundRecord& r : found.copies) {
    const auto original = originals.find(identity(r));
    if (original != originals.end())
      distances.emplace(r.offset_bytes, static_cast<std::int64_t>(r.offset_bytes) -
                                            static_cast<std::int64_t>(original->second));
  }
  if (distances.empty() && !found.copies.empty())
    distances.emplace(0, static_cast<std::int64_t>(found.copies.front().offset_bytes) -
                             static_cast<std::int64_t>(kSignature.size()));
  std::vector<std::int64_t> places;
  for (const FoundRecord& r : found.copies) {
    const auto offset = static_cast<std::int64_t>(r.offset_bytes);
    auto near = distances.lower_bound(offset);
    const bool before_is_nearer =
        near == distances.end() ||
        (near != distances.begin() && offset - std::prev(near)->first < near->first - offset);
    if (before_is_nearer) --near;
    places.push_back(offset - near->second);
  }
  return places;
}

/// Originals and copies joined, in the order of the file.
std::vector<Slot> arrange(const Survey& found) {
  std::map<Identity, Slot> slots;
  for (const FoundRecord& r : found.originals) {
    const auto place = static_cast<std::int64_t>(r.offset_bytes);
    const auto [at, is_new] = slots.try_emplace(identity(r), Slot{r, place, r.intact});
    if (is_new || !r.intact || at->second.original_intact) continue;
    at->second.record = r;
    at->second.original_intact = true;
  }
  const auto places = places_of_copies(found);
  for (std::size_t i = 0; i < found.copies.size(); ++i) {
    const FoundRecord& r = found.copies[i];
    const auto [at, is_new] = slots.try_emplace(identity(r), Slot{r, places[i], false});
    if (!is_new && r.intact && !at->second.record.intact) at->second.record = r;
  }
  std::vector<Slot> ordered;
  for (auto& [id, slot] : slots) ordered.push_back(slot);
  std::ranges::sort(ordered, {}, [](const Slot& s) {
    return std::tuple(order_of(s.record.header.type), s.place);
  });
  return ordered;
}

class StaticRecovery {
 public:
  StaticRecovery(RecordScan& scan, const Survey& found) : scan_(scan), found_(found) {}

  Result<StaticPart> run() {
    const auto slots = arrange(found_);
    for (const Slot& slot : slots) RELIT_TRY(take(slot));
    note_holes(slots);
    if (!has_header_) {
      part_.lost.push_back("the header: who wrote the file is unknown");
      contents().header.writer = "unknown";
    }
    drop_orphans();
    drop_what_does_not_play();
    RELIT_TRY(check());
    return std::move(part_);
  }

 private:
  FileContents& contents() { return part_.contents; }

  Status take(const Slot& slot) {
    if (!slot.record.intact) {
      part_.lost.push_back(describe(slot.record) + ": neither it nor a copy is intact");
      return {};
    }
    RELIT_TRY(scan_.read_again(slot.record));
    const Status parsed = parse(slot.record.header.type);
    if (!parsed && slot.record.header.type == types::kHeader) return parsed;
    if (!parsed) {
      part_.lost.push_back(describe(slot.record) + ": " + parsed.error().message);
    } else if (!slot.original_intact) {
      part_.repaired.push_back(std::string("a ") + kind_name(slot.record.header.type) +
                               " from its copy at byte " +
                               std::to_string(slot.record.offset_bytes));
    }
    return {};
  }

  Status parse(RecordType type) {
    const auto payload = scan_.payload();
    if (type == types::kHeader) return keep_header(parse_header(payload));
    if (type == types::kClip) return keep(parse_clip(payload), contents().clips);
    if (type == types::kImage) return keep(parse_image(payload), contents().images);
    if (type == types::kMaterial) return keep(parse_material(payload), contents().materials);
    if (type == types::kMesh) return keep(parse_mesh(payload), contents().meshes);
    if (type == types::kSkeleton) return keep_skeleton(parse_skeleton(payload));
    if (type == types::kPoseTrack) return keep_pose(parse_pose_track(payload));
    if (type == types::kModel) return keep(parse_model(payload), contents().models);
    return keep(parse_layer(payload), contents().layers);
  }

  template <class R>
  static Status keep(Result<R> record, std::vector<R>& records) {
    if (!record) return Unexpected{std::move(record).error()};
    if (std::ranges::find(records, record->id, &R::id) != records.end())
      return fail(ErrorCode::kCorrupt, "its id is taken by an earlier one");
    records.push_back(std::move(*record));
    return {};
  }
  Status keep_header(Result<HeaderRecord> header) {
    if (!header) return Unexpected{std::move(header).error()};
    if (!has_header_) contents().header = std::move(*header);
    has_header_ = true;
    return {};
  }
  Status keep_skeleton(Result<SkeletonRecord> skeleton) {
    if (!skeleton) return Unexpected{std::move(skeleton).error()};
    if (has_skeleton_) return fail(ErrorCode::kCorrupt, "a file has one skeleton");
    has_skeleton_ = true;
    contents().skeleton = std::move(*skeleton);
    return {};
  }
  Status keep_pose(Result<PoseTrackRecord> pose) {
    if (!pose) return Unexpected{std::move(pose).error()};
    contents().pose_tracks.push_back(std::move(*pose));
    return {};
  }

  /// Bytes of the static part that no record accounts for: what stood there nobody knows.
  void note_holes(const std::vector<Slot>& slots) {
    auto end = found_.static_end;
    if (found_.index && !found_.index->segments.empty())
      end = std::min(end.value_or(UINT64_MAX), found_.index->segments.front().offset);
    if (!end) return;
    std::vector<std::pair<std::int64_t, std::uint64_t>> pieces;
    for (const Slot& s : slots) pieces.emplace_back(s.place, s.record.header.payload_bytes);
    for (const FoundRecord& r : found_.others)
      pieces.emplace_back(static_cast<std::int64_t>(r.offset_bytes), r.header.payload_bytes);
    std::ranges::sort(pieces);
    auto at = static_cast<std::int64_t>(kSignature.size());
    const auto note = [&](std::int64_t next) {
      if (next > at)
        part_.lost.push_back("what stood between bytes " + std::to_string(at) + " and " +
                             std::to_string(next) + " of the static part");
    };
    for (const auto& [place, payload] : pieces) {
      if (place >= static_cast<std::int64_t>(*end)) break;
      note(place);
      at = std::max(at, place + static_cast<std::int64_t>(record_bytes(payload)));
    }
    note(static_cast<std::int64_t>(*end));
  }

  /// References to what is gone.
  void drop_orphans() {
    for (MaterialRecord& material : contents().materials) {
      if (material.image_id < 0 ||
          has(contents().images, static_cast<std::uint32_t>(material.image_id)))
        continue;
      lost(label("material", material.id) + " loses its texture: " +
           label("image", static_cast<std::uint32_t>(material.image_id)) + " is gone");
      material.image_id = -1;
    }
    for (const MeshRecord& mesh : contents().meshes) {
      if (has(contents().materials, mesh.material_id)) continue;
      lost(label("mesh", mesh.id) + " turns plain white: " + label("material", mesh.material_id) +
           " is gone");
      MaterialRecord white;
      white.id = mesh.material_id;
      contents().materials.push_back(std::move(white));
    }
    if (!has_skeleton_) drop_jointed_meshes();
    std::erase_if(contents().layers, [&](const LayerRecord& layer) {
      if (has(contents().models, layer.model_id)) return false;
      lost(label("layer", layer.id) + ": " + label("model", layer.model_id) + " is gone");
      return true;
    });
  }

  void drop_jointed_meshes() {
    std::erase_if(contents().meshes, [&](const MeshRecord& mesh) {
      const bool jointed =
          !mesh.morph_targets.empty() || std::ranges::any_of(mesh.streams, [](auto& s) {
            return s.semantic == Semantic::kJoints;
          });
      if (jointed) lost(label("mesh", mesh.id) + ": the skeleton is gone");
      return jointed;
    });
  }

  /// What the segments say of each clip's tracks shows which declarations are gone.
  void drop_what_does_not_play() {
    drop_bad_poses();
    std::set<std::uint32_t> gone;
    for (const ClipRecord& clip : contents().clips) {
      const auto tracks = found_.tracks.find(clip.id);
      if (tracks == found_.tracks.end() || tracks->second.empty()) continue;
      const bool has_pose = std::ranges::any_of(
          contents().pose_tracks, [&](const PoseTrackRecord& p) { return p.clip_id == clip.id; });
      if (!has_pose && layer_of(tracks->second.front()) == nullptr) {
        lost(label("clip", clip.id) + " \"" + clip.name + "\": its pose is gone");
        gone.insert(clip.id);
      } else {
        drop_model_without_first_layer(tracks->second, has_pose ? 1 : 0);
      }
    }
    for (const std::uint32_t clip : gone) drop_clip(contents(), clip);
  }

  void drop_bad_poses() {
    ReferenceChecker references;
    for (const auto& clip : contents().clips) (void)references.add(clip);
    for (const auto& image : contents().images) (void)references.add(image);
    for (const auto& material : contents().materials) (void)references.add(material);
    for (const auto& mesh : contents().meshes) (void)references.add(mesh);
    (void)references.add(contents().skeleton);
    std::erase_if(contents().pose_tracks, [&](const PoseTrackRecord& pose) {
      const Status added = references.add(pose);
      if (!added) lost(label("the pose of clip", pose.clip_id) + ": " + added.error().message);
      return !added;
    });
  }

  /// Later layers refine the first one and are nothing without it.
  void drop_model_without_first_layer(const std::vector<std::uint32_t>& tracks,
                                      std::size_t first_layer_track) {
    if (tracks.size() <= first_layer_track || layer_of(tracks[first_layer_track]) != nullptr)
      return;
    for (const std::uint32_t track : tracks) {
      const LayerRecord* layer = layer_of(track);
      if (layer == nullptr) continue;
      const std::uint32_t model = layer->model_id;
      lost(label("model", model) + ": its first layer is gone");
      drop_model(model);
      return;
    }
  }

  void drop_model(std::uint32_t model) {
    std::erase_if(contents().layers, [&](const LayerRecord& l) { return l.model_id == model; });
    std::erase_if(contents().models, [&](const ModelRecord& m) { return m.id == model; });
  }

  [[nodiscard]] const LayerRecord* layer_of(std::uint32_t track) {
    const auto at = std::ranges::find_if(contents().layers, [&](const LayerRecord& l) {
      return l.mantissa_track == track || (l.has_exponents && l.exponent_track == track);
    });
    return at == contents().layers.end() ? nullptr : &*at;
  }

  template <class R>
  static bool has(const std::vector<R>& records, std::uint32_t id) {
    return std::ranges::find(records, id, &R::id) != records.end();
  }

  /// What the records still say wrongly of each other costs the record that says it.
  template <class R>
  void filter(ReferenceChecker& references, std::vector<R>& records, const char* what) {
    std::erase_if(records, [&](const R& record) {
      const Status added = references.add(record);
      if (!added) lost(std::string("a ") + what + ": " + added.error().message);
      return !added;
    });
  }

  Status check() {
    ReferenceChecker references;
    filter(references, contents().clips, "clip");
    filter(references, contents().images, "image");
    filter(references, contents().materials, "material");
    filter(references, contents().meshes, "mesh");
    RELIT_TRY(references.add(contents().skeleton));
    filter(references, contents().pose_tracks, "pose");
    filter(references, contents().models, "model");
    filter(references, contents().layers, "layer");
    if (contents().clips.empty()) return fail(ErrorCode::kCorrupt, "no clip is left");
    return references.finish();
  }

  void lost(std::string what) { part_.lost.push_back(std::move(what)); }

  RecordScan& scan_;
  const Survey& found_;
  StaticPart part_;
  bool has_header_ = false;
  bool has_skeleton_ = false;
};

}  // namespace

Result<StaticPart> recover_static(RecordScan& scan, const Survey& found) {
  return StaticRecovery(scan, found).run();
}

}  // namespace relit::player
