// SPDX-License-Identifier: MIT
#include "player/rewrite.hpp"

#include <set>
#include <utility>

#include "player/source.hpp"

namespace relit::player {
namespace {

template <class R>
Status add_all(container::Writer& writer, const std::vector<R>& records) {
  for (const R& record : records) RELIT_TRY(writer.add(record));
  return {};
}

}  // namespace

Status write_static(container::Writer& writer, const container::FileContents& contents) {
  RELIT_TRY(add_all(writer, contents.clips));
  RELIT_TRY(add_all(writer, contents.images));
  RELIT_TRY(add_all(writer, contents.materials));
  RELIT_TRY(add_all(writer, contents.meshes));
  if (contents.skeleton != container::SkeletonRecord{}) RELIT_TRY(writer.add(contents.skeleton));
  RELIT_TRY(add_all(writer, contents.pose_tracks));
  RELIT_TRY(add_all(writer, contents.models));
  return add_all(writer, contents.layers);
}

void drop_clip(container::FileContents& contents, std::uint32_t clip_id) {
  std::set<std::uint32_t> models;
  for (const container::ModelRecord& model : contents.models)
    if (model.clip_id == clip_id) models.insert(model.id);
  std::erase_if(contents.layers,
                [&](const container::LayerRecord& l) { return models.contains(l.model_id); });
  std::erase_if(contents.models,
                [&](const container::ModelRecord& m) { return m.clip_id == clip_id; });
  std::erase_if(contents.pose_tracks,
                [&](const container::PoseTrackRecord& p) { return p.clip_id == clip_id; });
  std::erase_if(contents.clips, [&](const container::ClipRecord& c) { return c.id == clip_id; });
}

Status write_unknown(container::Writer& writer, const std::vector<UnknownRecord>& records) {
  for (const UnknownRecord& r : records) RELIT_TRY(writer.add_ancillary(r.type, r.payload));
  return {};
}

bool may_be_copied(container::RecordType type) {
  const auto fourth = static_cast<std::uint8_t>(static_cast<std::uint32_t>(type) >> 24);
  return container::order_of(type) < 0 && container::is_well_formed(type) &&
         !container::is_critical(type) && fourth >= 'a';
}

Unexpected RewriteSource::in_file(const Error& error) const {
  const bool damage = error.code == ErrorCode::kCorrupt || error.code == ErrorCode::kTruncated;
  return fail(error.code, name_ + ": " + error.message +
                              (damage ? "; `relit recover` keeps what is left" : ""));
}

Result<RewriteSource> RewriteSource::open(std::unique_ptr<container::ByteSource> source,
                                          std::string name) {
  const auto unknown = std::make_shared<std::vector<UnknownRecord>>();
  container::ReaderOptions options;
  options.on_unknown = [unknown](container::RecordType type, std::span<const std::uint8_t> bytes) {
    if (may_be_copied(type)) unknown->push_back({type, {bytes.begin(), bytes.end()}});
  };
  auto reader = container::Reader::open(std::move(source), options);
  if (!reader) return fail(reader.error().code, name + ": " + reader.error().message);
  RewriteSource opened(std::move(*reader), std::move(name), unknown);
  auto contents = container::load_static(opened.reader_);
  if (!contents) return opened.in_file(contents.error());
  opened.contents_ = std::move(*contents);
  return opened;
}

void RewriteSource::set_wanted_tracks(std::vector<std::uint32_t> tracks) {
  reader_.set_wanted_tracks(std::move(tracks));
}

Result<std::optional<WholeSegment>> RewriteSource::next() {
  WholeSegment whole;
  bool begun = ahead_.has_value();
  if (begun) whole.segment = *std::exchange(ahead_, std::nullopt);
  while (!ended_) {
    auto record = reader_.next();
    if (!record) return in_file(record.error());
    if (!*record && !reader_.finished())
      return in_file({ErrorCode::kTruncated, "the file ends without its end record"});
    if (!*record) {
      ended_ = true;
    } else if (auto* chunk = std::get_if<container::ChunkRecord>(&(*record)->body)) {
      whole.chunks.push_back(std::move(*chunk));
    } else if (auto* segment = std::get_if<container::SegmentRecord>(&(*record)->body)) {
      if (begun) {
        ahead_ = std::move(*segment);
        break;
      }
      begun = true;
      whole.segment = std::move(*segment);
    }
  }
  if (!begun) return std::optional<WholeSegment>();
  return std::optional<WholeSegment>(std::move(whole));
}

Result<RewriteSource> open_rewrite(const std::string& name) {
  RELIT_ASSIGN(auto bytes, open_source(name));
  return RewriteSource::open(std::move(bytes), source_name(name));
}

}  // namespace relit::player
