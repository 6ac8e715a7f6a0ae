// SPDX-License-Identifier: MIT
#include <algorithm>
#include <string>
#include <type_traits>

#include "container/base/limits.hpp"
#include "container/base/out_of_memory.hpp"
#include "container/reader.hpp"
#include "container/references.hpp"

namespace relit::container {
namespace {

void keep(FileContents& contents, ClipRecord&& r) { contents.clips.push_back(std::move(r)); }
void keep(FileContents& contents, ImageRecord&& r) { contents.images.push_back(std::move(r)); }
void keep(FileContents& contents, MaterialRecord&& r) {
  contents.materials.push_back(std::move(r));
}
void keep(FileContents& contents, MeshRecord&& r) { contents.meshes.push_back(std::move(r)); }
void keep(FileContents& contents, SkeletonRecord&& r) { contents.skeleton = std::move(r); }
void keep(FileContents& contents, PoseTrackRecord&& r) {
  contents.pose_tracks.push_back(std::move(r));
}
void keep(FileContents& contents, ModelRecord&& r) { contents.models.push_back(std::move(r)); }
void keep(FileContents& contents, LayerRecord&& r) { contents.layers.push_back(std::move(r)); }

template <class R>
constexpr bool kIsStatic = !std::is_same_v<R, SegmentRecord> && !std::is_same_v<R, ChunkRecord> &&
                           !std::is_same_v<R, IndexRecord> && !std::is_same_v<R, EndRecord>;

Status take(FileContents& contents, ReferenceChecker& references, Record&& record) {
  auto status = std::visit(
      [&]<class R>(R& body) -> Status {
        if constexpr (kIsStatic<R>) {
          RELIT_TRY(references.add(body));
          keep(contents, std::move(body));
        }
        return {};
      },
      record.body);
  if (status) return {};
  return fail(status.error().code, "record '" + type_name(record.type) + "' at byte " +
                                       std::to_string(record.offset_bytes) + ": " +
                                       status.error().message);
}

bool is_damage(const Error& error) {
  return error.code == ErrorCode::kCorrupt || error.code == ErrorCode::kTruncated;
}

/// The static records as they stand in the file, with gaps where one is damaged.
struct Gathered {
  std::vector<std::optional<Record>> records;
  std::optional<Error> damage;  ///< the first
  bool framing_lost = false;    ///< behind the last record: nothing is known of what follows
};

Result<Gathered> gather(Reader& reader) {
  Gathered found;
  for (;;) {
    const auto ended = reader.static_part_ended();
    if (ended && *ended) return found;
    auto record = ended ? reader.next() : Result<std::optional<Record>>(Unexpected{ended.error()});
    if (record && !*record) return found;
    if (found.records.size() == limits::kStaticRecords)
      return fail(ErrorCode::kLimit, "more than " + std::to_string(limits::kStaticRecords) +
                                         " records before the first segment");
    if (record) {
      found.records.push_back(std::move(*record));
      continue;
    }
    if (!is_damage(record.error())) return Unexpected{record.error()};
    if (!found.damage) found.damage = record.error();
    found.framing_lost = !reader.can_continue();
    if (found.framing_lost) return found;
    found.records.emplace_back();
  }
}

/// Fills the gaps with copies and returns how many. Errors: the damage, where a gap has none.
Result<std::uint32_t> repair(Reader& reader, Gathered& found) {
  const auto copies = reader.read_copies();
  // The framing may as well be lost behind the last of them, at the first segment.
  const bool complete = found.framing_lost && !found.records.empty() &&
                        std::ranges::all_of(found.records, [](auto& r) { return r.has_value(); }) &&
                        found.records.back()->type == types::kLayer;
  if (!copies && complete) return 0u;
  if (!copies) return Unexpected{*found.damage};
  const bool cut = found.framing_lost && found.records.size() < copies->size();
  if (cut) found.records.resize(copies->size());
  std::uint32_t filled = 0;
  for (std::size_t i = 0; i < found.records.size(); ++i) {
    if (found.records[i]) continue;
    if (i >= copies->size() || !(*copies)[i]) return Unexpected{*found.damage};
    found.records[i] = (*copies)[i];
    ++filled;
  }
  if (cut) RELIT_TRY(reader.resync());
  return filled;
}

Result<FileContents> load(Reader& reader) {
  FileContents contents;
  contents.header = reader.header();
  RELIT_ASSIGN(Gathered found, gather(reader));
  if (found.damage) {
    RELIT_ASSIGN(contents.repaired, repair(reader, found));
  }
  ReferenceChecker references;
  for (auto& record : found.records) RELIT_TRY(take(contents, references, std::move(*record)));
  if (auto status = references.finish(); !status)
    return fail(status.error().code, "records before byte " +
                                         std::to_string(reader.offset_bytes()) + ": " +
                                         status.error().message);
  return contents;
}

template <class R>
const R* find_by_id(const std::vector<R>& records, std::uint32_t id) {
  const auto it = std::ranges::find(records, id, &R::id);
  return it == records.end() ? nullptr : &*it;
}

}  // namespace

Result<FileContents> load_static(Reader& reader) {
  return catch_out_of_memory("reading the records before the first segment",
                             [&] { return load(reader); });
}

const ClipRecord* FileContents::find_clip(std::uint32_t id) const { return find_by_id(clips, id); }

const ModelRecord* FileContents::find_model(std::uint32_t id) const {
  return find_by_id(models, id);
}

std::vector<LayerRecord> FileContents::layers_of(std::uint32_t model_id) const {
  std::vector<LayerRecord> found;
  std::ranges::copy_if(layers, std::back_inserter(found),
                       [&](const LayerRecord& layer) { return layer.model_id == model_id; });
  return found;
}

}  // namespace relit::container
