// SPDX-License-Identifier: MIT
#include "player/memory_account.hpp"

#include <algorithm>
#include <glm/glm.hpp>
#include <utility>

#include "decoders/decoder_memory.hpp"
#include "decoders/image.hpp"
#include "decoders/plane_decoder.hpp"
#include "player/relighter.hpp"
#include "player/video_tracks.hpp"

namespace relit::player {
namespace {

using container::FileContents;
using container::LayerRecord;
using container::MeshRecord;
using container::Semantic;

/// What a process of `relit` has on the heap with nothing loaded: the C++ library's emergency pool,
/// the command line, FFmpeg's and the C library's own. Measured: 0.3 MiB.
constexpr std::uint64_t kProgramBytes = 320u << 10;
/// A zstd decompressor, while it works.
constexpr std::uint64_t kInflateBytes = 160u << 10;
/// Where segments are not known beforehand, coded planes are taken to be an eighth of plain ones.
constexpr std::uint64_t kUnknownRatio = 8;
/// Decoded frames beside those of the ring: the one that each decoder has ready.
constexpr std::uint64_t kFramesAhead = 1;

template <class T>
std::uint64_t bytes_of(const std::vector<T>& items) {
  return items.capacity() * sizeof(T);
}

std::uint64_t bytes_of(const std::string& text) {
  return text.capacity() > sizeof(std::string) ? text.capacity() + 1 : 0;
}

std::uint64_t record_bytes(const MeshRecord& mesh) {
  std::uint64_t sum = bytes_of(mesh.name) + bytes_of(mesh.streams) + bytes_of(mesh.indices) +
                      bytes_of(mesh.morph_targets);
  for (const container::VertexStream& stream : mesh.streams) sum += bytes_of(stream.bytes);
  for (const container::MorphTarget& target : mesh.morph_targets) sum += bytes_of(target.bytes);
  return sum;
}

std::uint64_t record_bytes(const LayerRecord& layer) {
  std::uint64_t sum = bytes_of(layer.codec) + bytes_of(layer.codec_private) +
                      bytes_of(layer.exponent_codec) + bytes_of(layer.exponent_private) +
                      bytes_of(layer.planes);
  for (const container::PlaneRecord& plane : layer.planes) sum += bytes_of(plane.matrix);
  return sum;
}

std::uint64_t record_bytes(const container::PoseTrackRecord& track) {
  return bytes_of(track.rest) + bytes_of(track.channels) + bytes_of(track.vertex_ranges);
}

std::uint64_t record_bytes(const container::SkeletonRecord& skeleton) {
  return bytes_of(skeleton.nodes) + bytes_of(skeleton.palette);
}

std::uint64_t contents_bytes(const FileContents& c) {
  std::uint64_t sum = bytes_of(c.header.writer) + bytes_of(c.clips) + bytes_of(c.images) +
                      bytes_of(c.materials) + bytes_of(c.meshes) + bytes_of(c.pose_tracks) +
                      bytes_of(c.models) + bytes_of(c.layers) + record_bytes(c.skeleton);
  for (const auto& image : c.images) sum += bytes_of(image.bytes) + bytes_of(image.media_type);
  for (const auto& material : c.materials) sum += bytes_of(material.name);
  for (const auto& mesh : c.meshes) sum += record_bytes(mesh);
  for (const auto& track : c.pose_tracks) sum += record_bytes(track);
  for (const auto& model : c.models) sum += bytes_of(model.mean);
  for (const auto& layer : c.layers) sum += record_bytes(layer);
  return sum;
}

bool has(const MeshRecord& mesh, Semantic semantic) {
  return std::any_of(mesh.streams.begin(), mesh.streams.end(),
                     [&](const auto& stream) { return stream.semantic == semantic; });
}

/// decoders::Mesh.
std::uint64_t decoded_bytes(const MeshRecord& mesh) {
  std::uint64_t a_vertex = 0;
  for (const container::VertexStream& stream : mesh.streams) {
    switch (stream.semantic) {
      case Semantic::kPosition:
      case Semantic::kNormal:
        a_vertex += sizeof(glm::vec3);
        break;
      case Semantic::kLightMapUv:
      case Semantic::kAlbedoUv:
        a_vertex += sizeof(glm::vec2);
        break;
      case Semantic::kColor:
        a_vertex += sizeof(glm::u8vec4);
        break;
      case Semantic::kJoints:
        a_vertex += 4 * sizeof(std::uint16_t);
        break;
      case Semantic::kWeights:
        a_vertex += 4 * sizeof(float);
        break;
      case Semantic::kTwin:
        break;
    }
  }
  a_vertex += mesh.morph_targets.size() * sizeof(glm::vec3);
  return a_vertex * mesh.vertex_count + mesh.index_count * sizeof(std::uint16_t) +
         mesh.morph_targets.size() * sizeof(std::vector<glm::vec3>);
}

/// What gles::CharacterRenderer puts into buffers.
std::uint64_t drawn_bytes(const MeshRecord& mesh) {
  std::uint64_t a_vertex = sizeof(glm::vec3) + sizeof(glm::vec2);
  if (has(mesh, Semantic::kAlbedoUv)) a_vertex += sizeof(glm::vec2);
  if (has(mesh, Semantic::kColor)) a_vertex += sizeof(glm::u8vec4);
  return a_vertex * mesh.vertex_count + mesh.index_count * sizeof(std::uint16_t);
}

/// The largest payload that is read in one piece before the segments.
std::uint64_t largest_record(const FileContents& c) {
  std::uint64_t largest = 0;
  for (const auto& image : c.images) largest = std::max<std::uint64_t>(largest, image.bytes.size());
  for (const auto& mesh : c.meshes) largest = std::max(largest, record_bytes(mesh));
  return largest;
}

std::uint64_t light_map_texel_bytes(gles::LightMapFormat format) {
  if (format == gles::LightMapFormat::kSquareRoot8) return 4;
  return format == gles::LightMapFormat::kFloat ? 16 : 8;
}

/// gles::Compositor looks at 256 samples of every plane of two frames to find a square root's peak.
std::uint64_t sample_bytes(gles::LightMapFormat format, std::uint64_t planes) {
  return format == gles::LightMapFormat::kSquareRoot8 ? 2 * planes * 256 * sizeof(float) : 0;
}

/// gles::Framebuffer::gpu_bytes() of a context with four samples a pixel.
std::uint64_t framebuffer_bytes(const DrawingScale& drawing) {
  const std::uint64_t pixels = static_cast<std::uint64_t>(drawing.framebuffer_width) *
                               static_cast<std::uint64_t>(drawing.framebuffer_height);
  const std::uint64_t factor = drawing.samples >= 16 ? 2 : 1;
  const std::uint64_t drawn = pixels * factor * factor;
  std::uint64_t sum = drawing.samples >= 4 ? 2 * 4 * 4 * drawn : 4 * drawn;
  for (std::uint64_t size = drawn; size >= pixels && size > 0; size /= 4) sum += 4 * size;
  return sum;
}

/// Of the pictures that a decoder keeps, those that have been shown: a ring that reaches back to
/// them holds the same buffers. All but the one being decoded and those that wait for their turn,
/// two where references form a pyramid (five pictures and more), else one.
std::uint64_t shown_references(int pictures) {
  const int waiting = pictures >= 5 ? 2 : 1;
  return static_cast<std::uint64_t>(std::max(pictures - 1 - waiting, 0));
}

std::string count_of(std::uint64_t count, const char* one, const char* many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

}  // namespace

int threads_of_decoder(int threads, std::size_t layers) {
  return std::max(1, threads / static_cast<int>(std::max<std::size_t>(layers, 1)));
}

Result<MemoryAccount> MemoryAccount::create(const FileContents& contents,
                                            const SegmentScale& segments,
                                            const MemoryWishes& wishes) {
  MemoryAccount account;
  account.contents_ = &contents;
  account.wishes_ = wishes;
  account.segments_ = segments;
  RELIT_TRY(account.find_records(contents));
  for (const Layer& layer : account.layers_) {
    RELIT_TRY(decoders::check_layer(*account.model_, *layer.record));
  }
  account.measure_layers();
  account.measure_poses();
  if (account.drawn()) {
    account.measure_images();
    account.measure_sheets();
  }
  return account;
}

Status MemoryAccount::find_records(const FileContents& contents) {
  RELIT_ASSIGN(clip_, find_clip(contents, wishes_.clip, "plan"));
  for (const auto& model : contents.models) {
    if (model_ == nullptr && model.clip_id == clip_->id) model_ = &model;
  }
  for (const auto& track : contents.pose_tracks) {
    if (pose_ == nullptr && track.clip_id == clip_->id) pose_ = &track;
  }
  if (model_ == nullptr || pose_ == nullptr) {
    return fail(ErrorCode::kNotFound,
                "clip \"" + clip_->name + "\" has no appearance model or no pose track");
  }
  for (const LayerRecord& record : contents.layers) {
    if (record.model_id == model_->id) layers_.push_back({&record, {}});
  }
  if (layers_.empty()) {
    return fail(ErrorCode::kNotFound, "clip \"" + clip_->name + "\" has no layers");
  }
  return {};
}

void MemoryAccount::measure_layers() {
  std::uint64_t plain_frame = 0;
  const auto add = [](Layer& layer, const decoders::VideoFormat& format, int pictures,
                      bool mantissas) {
    // What no decoder here takes is refused when it is opened.
    const auto padded = decoders::picture_buffer_bytes(format);
    const std::uint64_t plain =
        decoders::picture_bytes(format.width, format.height, format.chroma, format.bit_depth);
    layer.tracks.push_back({format, pictures, padded ? *padded : plain, mantissas});
  };
  for (Layer& layer : layers_) {
    const LayerRecord& record = *layer.record;
    add(layer, decoders::mantissa_format(record), record.mantissa_pictures, true);
    if (record.has_exponents) {
      add(layer, decoders::exponent_format(record), record.exponent_pictures, false);
    }
    for (const Track& track : layer.tracks) {
      const decoders::VideoFormat& f = track.format;
      plain_frame += decoders::picture_bytes(f.width, f.height, f.chroma, f.bit_depth);
    }
  }
  if (segments_.frames == 0) {
    const auto half_a_second =
        static_cast<std::uint64_t>(0.5 * static_cast<double>(clip_->tick_rate.num) /
                                   static_cast<double>(clip_->tick_rate.den));
    segments_.frames = std::clamp<std::uint64_t>(half_a_second, 1, clip_->frame_count);
    segments_.bytes = segments_.frames * plain_frame / kUnknownRatio;
  }
}

void MemoryAccount::measure_poses() {
  const container::SkeletonRecord& skeleton = contents_->skeleton;
  std::uint64_t vertices = 0;
  for (const MeshRecord& mesh : contents_->meshes) vertices += mesh.vertex_count;
  std::uint64_t values = 0;
  if (pose_->kind == container::PoseKind::kVertices) {
    values = 3 * vertices;
    pose_frame_bytes_ =
        vertices * sizeof(glm::vec3) + contents_->meshes.size() * sizeof(std::vector<glm::vec3>);
  } else {
    for (const container::PoseChannel& channel : pose_->channels) {
      values += channel.target == container::ChannelTarget::kMorphWeight ? 1 : 3;
    }
    pose_frame_bytes_ = (skeleton.palette.size() + skeleton.nodes.size()) * sizeof(glm::mat4x3) +
                        skeleton.morph_weight_count * sizeof(float);
  }
  pose_segment_bytes_ = values * segments_.frames * sizeof(std::uint16_t);
  // PoseTrack's copies of the records, and its plan of the nodes.
  constexpr std::uint64_t kNodePlanBytes = 112;
  pose_fixed_bytes_ =
      record_bytes(skeleton) + record_bytes(*pose_) + skeleton.nodes.size() * kNodePlanBytes +
      skeleton.palette.size() * sizeof(glm::mat4x3) + pose_->channels.size() * sizeof(std::size_t);
}

void MemoryAccount::measure_images() {
  std::vector<std::uint64_t> texels;
  for (const container::ImageRecord& image : contents_->images) {
    const auto size = decoders::image_size(image.bytes);
    // What does not decode is drawn without, and costs nothing.
    texels.push_back(size ? static_cast<std::uint64_t>(size->width) *
                                static_cast<std::uint64_t>(size->height)
                          : 0);
    // One at a time: its texels, libavcodec's picture, and that one's copy of the packet.
    images_working_bytes_ =
        std::max<std::uint64_t>(images_working_bytes_, 8 * texels.back() + image.bytes.size());
  }
  // One texture for each way in which an image is sampled (gles::MaterialTextures).
  const auto& materials = contents_->materials;
  for (std::size_t i = 0; i < materials.size(); ++i) {
    const auto same = [&](const container::MaterialRecord& m) {
      return m.image_id == materials[i].image_id && m.wrap_u == materials[i].wrap_u &&
             m.wrap_v == materials[i].wrap_v && m.linear_filter == materials[i].linear_filter;
    };
    const auto end = materials.begin() + static_cast<std::ptrdiff_t>(i);
    if (std::find_if(materials.begin(), end, same) != end) continue;
    for (std::size_t k = 0; k < contents_->images.size(); ++k) {
      if (static_cast<std::int64_t>(contents_->images[k].id) != materials[i].image_id) continue;
      images_gpu_bytes_ += 4 * texels[k];
      if (materials[i].linear_filter) images_gpu_bytes_ += 4 * texels[k] / 3;
    }
  }
}

// The compositor makes room for the planes of all layers, also those that are never decoded.
void MemoryAccount::measure_sheets() {
  const std::vector<LayerRecord> layers = contents_->layers_of(model_->id);
  const gles::PlaneSetDescription description = describe_planes(*model_, layers);
  plane_count_ = description.planes.size();
  const auto measured = gles::PlaneSheets::measure(description, wishes_.drawing->max_texture_size);
  // What does not fit into textures is composited on the CPU.
  sheets_possible_ = measured.has_value();
  if (measured) sheets_ = *measured;
}

std::uint64_t MemoryAccount::frame_bytes(std::size_t layers) const {
  std::uint64_t sum = pose_frame_bytes_;
  for (std::size_t l = 0; l < std::min(layers, layers_.size()); ++l) {
    for (const Track& track : layers_[l].tracks) sum += track.picture_bytes;
  }
  return sum;
}

std::vector<MemoryTerm> MemoryAccount::own_terms(const MemoryChoice& choice) const {
  std::vector<MemoryTerm> terms;
  add_decoding(terms, choice);
  if (wishes_.composite) add_composite(terms, choice);
  return terms;
}

std::uint64_t MemoryAccount::own_bytes(const MemoryChoice& choice) const {
  std::uint64_t sum = 0;
  for (const MemoryTerm& term : own_terms(choice)) sum += term.heap_bytes + term.gpu_bytes;
  return sum;
}

std::vector<MemoryTerm> MemoryAccount::terms(const MemoryChoice& choice,
                                             const MemoryAccount* other) const {
  std::vector<MemoryTerm> terms;
  add_file(terms);
  const auto own = own_terms(choice);
  terms.insert(terms.end(), own.begin(), own.end());
  if (other != nullptr) add_other(terms, choice, *other);
  if (drawn()) add_drawing(terms);
  std::erase_if(terms, [](const MemoryTerm& t) { return t.heap_bytes == 0 && t.gpu_bytes == 0; });
  return terms;
}

// The map that two are joined in has the format and the size of the clip's that comes, which may be
// either.
void MemoryAccount::add_other(std::vector<MemoryTerm>& terms, const MemoryChoice& choice,
                              const MemoryAccount& other) const {
  MemoryTerm sum{"second clip",
                 "\"" + other.clip_->name +
                     "\" beside it, in a cross-fade or as the next: decoders, frames, light map"};
  for (const MemoryTerm& term : other.own_terms(choice)) {
    sum.heap_bytes += term.heap_bytes;
    sum.gpu_bytes += term.gpu_bytes;
  }
  terms.push_back(sum);
  if (!wishes_.composite) return;
  const auto texels = [](const container::ModelRecord& model) {
    return std::uint64_t{model.width} * model.height;
  };
  const std::uint64_t full = std::max(texels(*model_), texels(*other.model_));
  const bool on_gpu = drawn() && choice.path != CompositePath::kCpu;
  terms.push_back({"cross-fade", "the light map that two clips are joined in",
                   full * 3 * sizeof(float),
                   on_gpu ? full * light_map_texel_bytes(choice.light_map) : 0});
}

void MemoryAccount::add_file(std::vector<MemoryTerm>& terms) const {
  std::uint64_t meshes = bytes_of(contents_->meshes);
  for (const MeshRecord& mesh : contents_->meshes) meshes += decoded_bytes(mesh);
  terms.push_back({"program", "the program and its libraries, with nothing loaded", kProgramBytes});
  terms.push_back({"records",
                   "the file's records before its segments, images and meshes as they are coded",
                   contents_bytes(*contents_)});
  terms.push_back({"reading", "the largest record, as it is read, and what unpacks it",
                   std::max(largest_record(*contents_), segments_.bytes) + kInflateBytes});
  terms.push_back({"meshes", "decoded meshes", meshes});
  terms.push_back({"light", "pictures of the lights", wishes_.light_bytes});
}

// Segments whose packets and poses are here at once: those that the ring reaches over, and the one
// that is being read.
std::uint64_t MemoryAccount::segments_held(std::uint64_t ring_frames) const {
  return (ring_frames + segments_.frames - 1) / segments_.frames + 1;
}

void MemoryAccount::add_decoding(std::vector<MemoryTerm>& terms, const MemoryChoice& choice) const {
  std::uint64_t contexts = 0, references = 0, streams = 0;
  const int threads = threads_of_decoder(choice.threads, choice.layers);
  for (std::size_t l = 0; l < std::min(choice.layers, layers_.size()); ++l) {
    for (const Track& track : layers_[l].tracks) {
      const decoders::DecoderMemory memory =
          decoders::decoder_memory(track.format, track.pictures, track.mantissas ? threads : 1);
      ++streams;
      contexts += memory.context_bytes;
      const std::uint64_t shared = std::min(choice.ring_frames, shown_references(track.pictures));
      references += track.picture_bytes * (memory.pictures + kFramesAhead - shared);
    }
  }
  const std::uint64_t segments = segments_held(choice.ring_frames);
  const std::uint64_t frame = std::max(frame_bytes(choice.layers), choice.frame_bytes);
  terms.push_back({"decoders",
                   count_of(streams, "decoder", "decoders") + " on " +
                       count_of(static_cast<std::uint64_t>(choice.threads), "thread", "threads"),
                   contexts});
  terms.push_back({"references",
                   "pictures outside the ring that the decoders refer to, reorder and work on",
                   references});
  terms.push_back({"ring",
                   count_of(choice.ring_frames, "frame", "frames") + " decoded ahead of " +
                       std::to_string(frame) + " bytes",
                   choice.ring_frames * frame});
  terms.push_back({"packets", "coded packets of " + count_of(segments, "segment", "segments"),
                   segments * std::max(segments_.bytes, choice.segment_bytes)});
  terms.push_back({"poses", "the pose track and its decoded segments",
                   pose_fixed_bytes_ + segments * pose_segment_bytes_});
}

// Relighter's buffers. Where the governor halves the light map it makes a second one of a quarter
// of the texels.
void MemoryAccount::add_composite(std::vector<MemoryTerm>& terms,
                                  const MemoryChoice& choice) const {
  const auto half = [](std::uint64_t side) { return (side + 1) / 2; };
  const std::uint64_t full = std::uint64_t{model_->width} * model_->height;
  const std::uint64_t quarter = half(model_->width) * half(model_->height);
  const std::uint64_t texel = light_map_texel_bytes(choice.light_map);
  const bool any = choice.path == CompositePath::kAuto;
  const bool on_cpu = any || choice.path == CompositePath::kCpu || !drawn() || !sheets_possible_;
  const bool on_gpu = choice.path != CompositePath::kCpu && drawn() && sheets_possible_;
  std::uint64_t spare_heap = 0, spare_gpu = 0;
  if (on_cpu) {
    terms.push_back({"cpu composite", "the light map as floats, and as it is uploaded",
                     full * 3 * sizeof(float) + (drawn() ? full * texel : 0),
                     drawn() ? 2 * full * texel : 0});
    spare_heap += quarter * texel;
    spare_gpu += 2 * quarter * texel;
  }
  if (model_->prediction_plane >= 0) {
    terms.push_back({"normals",
                     "of the light map's texels, of two frames, that the model predicts by",
                     FrameNormals::memory_bytes(contents_->meshes, *model_, on_cpu, on_gpu)});
  }
  if (on_gpu) {
    terms.push_back({"plane textures", "planes as they were decoded, of two frames",
                     sheets_.cpu + sample_bytes(choice.light_map, plane_count_), sheets_.gpu});
    terms.push_back({"light map", "the texture that is composited into", 0, full * texel});
    spare_gpu += quarter * texel;
    // Square roots of two frames do not add up: each gets a map of its own, and a third joins them.
    if (choice.light_map == gles::LightMapFormat::kSquareRoot8) {
      spare_gpu += 2 * (full + quarter) * texel;
    }
  }
  if (drawn()) {
    terms.push_back({"light map at half size", "for when playback is behind, and for blends",
                     spare_heap, spare_gpu});
  }
}

void MemoryAccount::add_drawing(std::vector<MemoryTerm>& terms) const {
  const DrawingScale& drawing = *wishes_.drawing;
  std::uint64_t meshes = 0, most = 0;
  for (const MeshRecord& mesh : contents_->meshes) {
    meshes += drawn_bytes(mesh);
    most = std::max<std::uint64_t>(most, mesh.vertex_count);
  }
  const auto side = static_cast<std::uint64_t>(drawing.background_side);
  terms.push_back({"drawn meshes", "vertices and triangles in the GPU's buffers",
                   most * sizeof(glm::vec3), meshes});
  terms.push_back({"images",
                   "the materials' images: the largest while it is uploaded, and textures",
                   images_working_bytes_, images_gpu_bytes_});
  // One face at a time, as floats and as halves.
  terms.push_back({"background", "the environment's cube map",
                   side * side * (3 * sizeof(float) + 8), 6 * side * side * 8});
  terms.push_back(
      {"framebuffer", "the picture, its samples and its depth", 0, framebuffer_bytes(drawing)});
}

}  // namespace relit::player
