// SPDX-License-Identifier: MIT
#include <algorithm>
#include <new>
#include <string>
#include <type_traits>

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

Result<FileContents> load(Reader& reader) {
  FileContents contents;
  contents.header = reader.header();
  ReferenceChecker references;
  for (;;) {
    const auto ended = reader.static_part_ended();
    if (!ended) {
      const auto code = ended.error().code;
      const bool damage = code == ErrorCode::kCorrupt || code == ErrorCode::kTruncated;
      if (!damage || contents.layers.empty()) return Unexpected{ended.error()};
    }
    if (!ended || *ended) break;
    RELIT_ASSIGN(auto record, reader.next());
    if (!record) break;
    RELIT_TRY(take(contents, references, std::move(*record)));
  }
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
  try {
    return load(reader);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kOutOfMemory, "out of memory while reading the records before byte " +
                                             std::to_string(reader.offset_bytes()));
  }
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
