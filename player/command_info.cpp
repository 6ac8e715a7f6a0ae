// SPDX-License-Identifier: MIT
#include <cstdio>

#include "decoders/sh.hpp"
#include "player/command.hpp"
#include "player/file_survey.hpp"

namespace relit::player {
namespace {

struct InfoArguments {
  SourceArguments source;
  bool json = false;
};

Result<FileSurvey> survey(const InfoArguments& arguments) {
  RELIT_ASSIGN(auto source, open_source(arguments.source, !arguments.json));
  auto found = survey_file(std::move(source), arguments.json);
  if (!found) return fail(found.error().code, arguments.source.name + ": " + found.error().message);
  return found;
}

unsigned long long bytes_of(const FileSurvey& s, std::uint32_t track) {
  const auto found = s.track_bytes.find(track);
  return found == s.track_bytes.end() ? 0 : found->second;
}

void print_layer(const FileSurvey& s, const container::LayerRecord& layer) {
  std::printf("    layer %u: %zu planes, %s %d-bit %s %dx%d%s, %llu bytes", layer.id,
              layer.planes.size(), layer.codec.c_str(), layer.bit_depth, chroma_name(layer.chroma),
              layer.coded_width, layer.coded_height, layer.lossless ? ", lossless" : "",
              bytes_of(s, layer.mantissa_track));
  if (layer.has_exponents) {
    std::printf("; exponents %s per %dx%d, %llu bytes", layer.exponent_codec.c_str(),
                layer.exponent_block, layer.exponent_block, bytes_of(s, layer.exponent_track));
  }
  std::printf("\n");
}

void print(const FileSurvey& s, const std::string& name) {
  std::printf("%s: relit %d.%d by %s, %llu bytes, %llu segments%s\n", name.c_str(),
              s.contents.header.version_major, s.contents.header.version_minor,
              s.contents.header.writer.c_str(), static_cast<unsigned long long>(s.bytes),
              static_cast<unsigned long long>(s.segments.size()),
              s.end ? "" : ", cut off or still being written");
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
    std::printf("  pose of clip %u: %s, %llu bytes\n", pose.clip_id, pose_kind_name(pose.kind),
                bytes_of(s, pose.track_id));
  }
  for (const auto& model : s.contents.models) {
    std::printf("  model %u of clip %u: SH light map, order %d (%d coefficients), %dx%d texels\n",
                model.id, model.clip_id, model.order, decoders::coefficient_count(model.order),
                model.width, model.height);
    for (const auto& layer : s.contents.layers_of(model.id)) print_layer(s, layer);
  }
}

int run_info(const InfoArguments& arguments) {
  const Result<FileSurvey> found = survey(arguments);
  if (!found) return report(found.error());
  if (arguments.json) {
    std::printf("%s\n", survey_json(*found)
                            .dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace)
                            .c_str());
  } else {
    print(*found, arguments.source.name);
  }
  if (found->damage.empty()) return kSuccess;
  std::fprintf(stderr, "relit: %s: damaged: %s\n", arguments.source.name.c_str(),
               found->damage.c_str());
  return kWithLosses;
}

}  // namespace

void add_info(CommandLine& line) {
  Options command = line.add("info", "say what a file holds");
  const auto arguments = std::make_shared<InfoArguments>();
  add_source_options(command, arguments->source, "path, - or http(s)://");
  command.flag("--json", arguments->json, "as JSON, to standard output");
  command.runs([arguments] { return run_info(*arguments); });
}

}  // namespace relit::player
