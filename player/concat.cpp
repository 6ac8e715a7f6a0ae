// SPDX-License-Identifier: MIT
#include "player/concat.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string>

namespace relit::player {
namespace {

using namespace container;

using Ids = std::map<std::uint32_t, std::uint32_t>;  ///< of a source -> of the output

/// Compares what belongs to the character, and learns the ids of the first file.
class SameCharacter {
 public:
  SameCharacter(const RewriteSource& first, const RewriteSource& other)
      : first_(first), other_(other) {}

  /// The ids of meshes. Errors: kInvalid naming the first difference.
  Result<Ids> compare() {
    const FileContents &a = first_.contents(), &b = other_.contents();
    RELIT_TRY(same(a.images, b.images, "image", images_, [](ImageRecord&) {}));
    RELIT_TRY(same(a.materials, b.materials, "material", materials_, [&](MaterialRecord& m) {
      if (m.image_id >= 0)
        m.image_id = static_cast<std::int32_t>(images_.at(static_cast<std::uint32_t>(m.image_id)));
    }));
    RELIT_TRY(same(a.meshes, b.meshes, "mesh", meshes_,
                   [&](MeshRecord& m) { m.material_id = materials_.at(m.material_id); }));
    if (a.skeleton != b.skeleton) return differs("skeleton");
    return meshes_;
  }

 private:
  /// `adapt` turns the references of a record of the other file into those of the first.
  template <class R, class Adapt>
  Status same(const std::vector<R>& a, const std::vector<R>& b, const char* what, Ids& ids,
              Adapt&& adapt) {
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
      R adapted = b[i];
      ids[adapted.id] = a[i].id;
      adapted.id = a[i].id;
      adapt(adapted);
      if (adapted != a[i]) return differs(what + (" " + std::to_string(i)) + name_of(a[i]));
    }
    if (a.size() == b.size()) return {};
    return fail(ErrorCode::kInvalid, other_.name() + " has " + std::to_string(b.size()) +
                                         " records of kind " + what + ", " + first_.name() +
                                         " has " + std::to_string(a.size()) +
                                         ": only files of the same character can be joined");
  }

  template <class R>
  static std::string name_of(const R& record) {
    if constexpr (requires { record.name; })
      return " \"" + record.name + "\"";
    else
      return "";
  }

  [[nodiscard]] Unexpected differs(const std::string& what) const {
    return fail(ErrorCode::kInvalid, other_.name() + ": " + what + " differs from that of " +
                                         first_.name() +
                                         ": only files of the same character can be joined");
  }

  const RewriteSource& first_;
  const RewriteSource& other_;
  Ids images_, materials_, meshes_;
};

/// Ids of one kind in the output: a record keeps its own while nobody has it.
class IdSpace {
 public:
  std::uint32_t take(std::uint32_t wanted) {
    if (used_.insert(wanted).second) return wanted;
    while (!used_.insert(next_).second) ++next_;
    return next_++;
  }

 private:
  std::set<std::uint32_t> used_;
  std::uint32_t next_ = 0;
};

/// The output's static part, and what became of each source's ids.
class Joined {
 public:
  struct Renamed {
    Ids clips, tracks;
  };

  explicit Joined(const RewriteSource& first) {
    contents_ = first.contents();
    contents_.clips.clear();
    contents_.pose_tracks.clear();
    contents_.models.clear();
    contents_.layers.clear();
  }

  Renamed add(const FileContents& other, const Ids& meshes) {
    Renamed renamed;
    Ids models;
    for (ClipRecord clip : other.clips) {
      clip.id = renamed.clips[clip.id] = clips_.take(clip.id);
      clip.name = free_name(clip.name);
      contents_.clips.push_back(std::move(clip));
    }
    const auto new_track = [&](std::uint32_t& track) {
      track = renamed.tracks[track] = tracks_.take(track);
    };
    for (PoseTrackRecord pose : other.pose_tracks) {
      pose.clip_id = renamed.clips.at(pose.clip_id);
      new_track(pose.track_id);
      for (VertexRange& range : pose.vertex_ranges) range.mesh_id = meshes.at(range.mesh_id);
      contents_.pose_tracks.push_back(std::move(pose));
    }
    for (ModelRecord model : other.models) {
      model.clip_id = renamed.clips.at(model.clip_id);
      model.id = models[model.id] = models_.take(model.id);
      contents_.models.push_back(std::move(model));
    }
    for (LayerRecord layer : other.layers) {
      layer.id = layers_.take(layer.id);
      layer.model_id = models.at(layer.model_id);
      new_track(layer.mantissa_track);
      if (layer.has_exponents) new_track(layer.exponent_track);
      contents_.layers.push_back(std::move(layer));
    }
    return renamed;
  }

  [[nodiscard]] const FileContents& contents() const { return contents_; }

 private:
  std::string free_name(const std::string& wanted) {
    std::string name = wanted;
    for (int n = 2; !names_.insert(name).second; ++n) name = wanted + " " + std::to_string(n);
    return name;
  }

  FileContents contents_;
  std::set<std::string> names_;
  IdSpace clips_, models_, layers_, tracks_;
};

Status copy_segments(Writer& writer, RewriteSource& source, const Joined::Renamed& renamed) {
  for (;;) {
    RELIT_ASSIGN(auto whole, source.next());
    if (!whole) break;
    const SegmentRecord& s = whole->segment;
    const auto clip = renamed.clips.find(s.clip_id);
    if (clip == renamed.clips.end())
      return fail(ErrorCode::kCorrupt, source.name() + ": segment " + std::to_string(s.index) +
                                           " belongs to clip " + std::to_string(s.clip_id) +
                                           ", which does not exist");
    // Readers pass over tracks that nobody declares, and so do we.
    std::erase_if(whole->chunks,
                  [&](const ChunkRecord& c) { return !renamed.tracks.contains(c.track_id); });
    for (ChunkRecord& chunk : whole->chunks) chunk.track_id = renamed.tracks.at(chunk.track_id);
    RELIT_TRY(writer.write_segment(
        {clip->second, s.first_frame, s.frame_count, s.durations, s.first_tick},
        std::move(whole->chunks)));
    RELIT_TRY(write_unknown(writer, source.take_unknown()));
  }
  return write_unknown(writer, source.take_unknown());
}

}  // namespace

Status concat(std::vector<RewriteSource>& sources, ByteSink& sink) {
  if (sources.empty()) return fail(ErrorCode::kInvalid, "there is nothing to join");
  Joined joined(sources.front());
  std::vector<Joined::Renamed> renamed;
  for (const RewriteSource& source : sources) {
    RELIT_ASSIGN(const Ids meshes, SameCharacter(sources.front(), source).compare());
    renamed.push_back(joined.add(source.contents(), meshes));
  }
  RELIT_ASSIGN(Writer writer, Writer::create(sink, joined.contents().header.writer,
                                             {.copies = true, .gaps = true}));
  RELIT_TRY(write_static(writer, joined.contents()));
  for (RewriteSource& source : sources) RELIT_TRY(write_unknown(writer, source.take_unknown()));
  for (std::size_t i = 0; i < sources.size(); ++i)
    RELIT_TRY(copy_segments(writer, sources[i], renamed[i]));
  return writer.finish();
}

}  // namespace relit::player
