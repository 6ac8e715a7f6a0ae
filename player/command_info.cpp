// SPDX-License-Identifier: MIT
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "player/command.hpp"

namespace relit::player {
namespace {

using nlohmann::ordered_json;

struct Arguments {
  SourceArguments source;
  bool json = false;
};

// Sizes by kind and by track, from the segments.
struct Survey {
  container::FileContents contents;
  std::uint64_t bytes = 0, segments = 0;
  std::map<std::uint32_t, std::uint64_t> track_bytes;
  bool complete = false;
  std::string damage;
};

Result<Survey> survey(const SourceArguments& arguments) {
  const std::string& name = arguments.name;
  RELIT_ASSIGN(auto source, open_source(arguments, true));
  container::ReaderOptions reading;
  reading.sparing = true;
  auto reader = container::Reader::open(std::move(source), reading);
  if (!reader) return fail(reader.error().code, name + ": " + reader.error().message);
  Survey found;
  auto contents = container::load_static(*reader);
  if (!contents) return fail(contents.error().code, name + ": " + contents.error().message);
  found.contents = std::move(*contents);
  reader->set_wanted_tracks(std::vector<std::uint32_t>{});
  for (;;) {
    auto record = reader->next();
    if (!record) {
      found.damage = record.error().message;
      if (reader->can_continue()) continue;
      auto again = reader->resync();
      if (!again || !*again) break;
      continue;
    }
    if (!*record) break;
    if (const auto* segment = std::get_if<container::SegmentRecord>(&(*record)->body)) {
      ++found.segments;
      for (const auto& chunk : segment->chunks)
        found.track_bytes[chunk.track_id] += chunk.chunk_bytes;
    }
  }
  found.complete = reader->finished();
  found.bytes = reader->offset_bytes();
  return found;
}

const char* chroma_name(container::Chroma chroma) {
  switch (chroma) {
    case container::Chroma::kLuma:
      return "luma";
    case container::Chroma::k420:
      return "4:2:0";
    case container::Chroma::k444:
      return "4:4:4";
  }
  return "?";
}

std::uint64_t bytes_of(const Survey& s, std::uint32_t track) {
  const auto found = s.track_bytes.find(track);
  return found == s.track_bytes.end() ? 0 : found->second;
}

ordered_json clips_json(const Survey& s) {
  ordered_json clips = ordered_json::array();
  for (const auto& clip : s.contents.clips) {
    clips.push_back({{"id", clip.id},
                     {"name", clip.name},
                     {"frames", clip.frame_count},
                     {"tick_rate", {clip.tick_rate.num, clip.tick_rate.den}},
                     {"duration_ticks", clip.duration_ticks},
                     {"duration_s", container::duration_s(clip)},
                     {"loop", clip.loop},
                     {"bounds", {clip.bounds_min, clip.bounds_max}}});
  }
  return clips;
}

ordered_json layer_json(const Survey& s, const container::LayerRecord& layer) {
  ordered_json json{{"id", layer.id},
                    {"codec", layer.codec},
                    {"bit_depth", layer.bit_depth},
                    {"chroma", chroma_name(layer.chroma)},
                    {"lossless", layer.lossless},
                    {"coded", {layer.coded_width, layer.coded_height}},
                    {"planes", layer.planes.size()},
                    {"track", layer.mantissa_track},
                    {"bytes", bytes_of(s, layer.mantissa_track)}};
  if (layer.has_exponents) {
    json["exponents"] = {{"codec", layer.exponent_codec},
                         {"block", layer.exponent_block},
                         {"coded", {layer.exponent_width, layer.exponent_height}},
                         {"track", layer.exponent_track},
                         {"bytes", bytes_of(s, layer.exponent_track)}};
  }
  return json;
}

ordered_json models_json(const Survey& s) {
  ordered_json models = ordered_json::array();
  for (const auto& model : s.contents.models) {
    ordered_json layers = ordered_json::array();
    for (const auto& layer : s.contents.layers_of(model.id)) layers.push_back(layer_json(s, layer));
    models.push_back({{"id", model.id},
                      {"clip", model.clip_id},
                      {"kind", "shlm"},
                      {"order", model.order},
                      {"size", {model.width, model.height}},
                      {"layers", layers}});
  }
  return models;
}

ordered_json to_json(const Survey& s) {
  ordered_json json;
  json["version"] = {s.contents.header.version_major, s.contents.header.version_minor};
  json["writer"] = s.contents.header.writer;
  json["bytes"] = s.bytes;
  json["complete"] = s.complete;
  json["segments"] = s.segments;
  json["clips"] = clips_json(s);
  ordered_json images = ordered_json::array(), materials = ordered_json::array(),
               meshes = ordered_json::array(), poses = ordered_json::array();
  for (const auto& image : s.contents.images) {
    images.push_back(
        {{"id", image.id}, {"media_type", image.media_type}, {"bytes", image.bytes.size()}});
  }
  for (const auto& m : s.contents.materials) {
    materials.push_back(
        {{"id", m.id}, {"name", m.name}, {"base_color", m.base_color}, {"image", m.image_id}});
  }
  for (const auto& mesh : s.contents.meshes) {
    meshes.push_back({{"id", mesh.id},
                      {"name", mesh.name},
                      {"material", mesh.material_id},
                      {"vertices", mesh.vertex_count},
                      {"triangles", mesh.index_count / 3},
                      {"morph_targets", mesh.morph_targets.size()}});
  }
  for (const auto& pose : s.contents.pose_tracks) {
    poses.push_back({{"track", pose.track_id},
                     {"clip", pose.clip_id},
                     {"kind", pose.kind == container::PoseKind::kJoints ? "joints" : "vertices"},
                     {"channels", pose.channels.size()},
                     {"bytes", bytes_of(s, pose.track_id)}});
  }
  json["images"] = images, json["materials"] = materials, json["meshes"] = meshes;
  json["nodes"] = s.contents.skeleton.nodes.size();
  json["poses"] = poses;
  json["models"] = models_json(s);
  return json;
}

void print_layer(const Survey& s, const container::LayerRecord& layer) {
  std::printf("    layer %u: %zu planes, %s %d-bit %s %dx%d%s, %llu bytes", layer.id,
              layer.planes.size(), layer.codec.c_str(), layer.bit_depth, chroma_name(layer.chroma),
              layer.coded_width, layer.coded_height, layer.lossless ? ", lossless" : "",
              static_cast<unsigned long long>(bytes_of(s, layer.mantissa_track)));
  if (layer.has_exponents) {
    std::printf("; exponents %s per %dx%d, %llu bytes", layer.exponent_codec.c_str(),
                layer.exponent_block, layer.exponent_block,
                static_cast<unsigned long long>(bytes_of(s, layer.exponent_track)));
  }
  std::printf("\n");
}

void print(const Survey& s, const std::string& name) {
  std::printf("%s: relit %d.%d by %s, %llu bytes, %llu segments%s\n", name.c_str(),
              s.contents.header.version_major, s.contents.header.version_minor,
              s.contents.header.writer.c_str(), static_cast<unsigned long long>(s.bytes),
              static_cast<unsigned long long>(s.segments),
              s.complete ? "" : ", cut off or still being written");
  for (const auto& clip : s.contents.clips) {
    std::printf("  clip %u \"%s\": %llu frames, %.4g frames/s, %.3f s%s\n", clip.id,
                clip.name.c_str(), static_cast<unsigned long long>(clip.frame_count),
                static_cast<double>(clip.tick_rate.num) / static_cast<double>(clip.tick_rate.den),
                container::duration_s(clip), clip.loop ? ", loops" : "");
  }
  std::size_t vertices = 0, triangles = 0, image_bytes = 0;
  for (const auto& mesh : s.contents.meshes)
    vertices += mesh.vertex_count, triangles += mesh.index_count / 3;
  for (const auto& image : s.contents.images) image_bytes += image.bytes.size();
  std::printf(
      "  %zu meshes, %zu vertices, %zu triangles, %zu nodes, %zu materials, %zu images (%zu "
      "bytes)\n",
      s.contents.meshes.size(), vertices, triangles, s.contents.skeleton.nodes.size(),
      s.contents.materials.size(), s.contents.images.size(), image_bytes);
  for (const auto& pose : s.contents.pose_tracks) {
    std::printf("  pose of clip %u: %s, %llu bytes\n", pose.clip_id,
                pose.kind == container::PoseKind::kJoints ? "joints" : "vertices",
                static_cast<unsigned long long>(bytes_of(s, pose.track_id)));
  }
  for (const auto& model : s.contents.models) {
    std::printf("  model %u of clip %u: SH light map, order %d (%d coefficients), %dx%d texels\n",
                model.id, model.clip_id, model.order, decoders::coefficient_count(model.order),
                model.width, model.height);
    for (const auto& layer : s.contents.layers_of(model.id)) print_layer(s, layer);
  }
}

int run(const Arguments& arguments) {
  const Result<Survey> found = survey(arguments.source);
  if (!found) return report(found.error());
  if (arguments.json) {
    std::printf(
        "%s\n",
        to_json(*found).dump(2, ' ', false, ordered_json::error_handler_t::replace).c_str());
  } else {
    print(*found, arguments.source.name);
  }
  if (found->damage.empty()) return kSuccess;
  std::fprintf(stderr, "relit: %s: damaged: %s\n", arguments.source.name.c_str(),
               found->damage.c_str());
  return kWithLosses;
}

}  // namespace

Command add_info(CLI::App& app) {
  CLI::App* command = app.add_subcommand("info", "say what a file holds");
  const auto arguments = std::make_shared<Arguments>();
  add_source_options(*command, arguments->source, "path, - or http(s)://");
  command->add_flag("--json", arguments->json, "as JSON, to standard output");
  return [arguments] { return run(*arguments); };
}

}  // namespace relit::player
