// SPDX-License-Identifier: MIT
#include <optional>

#include "decoders/coverage.hpp"
#include "decoders/npy.hpp"
#include "decoders/texel_normals.hpp"
#include "player/command.hpp"

namespace relit::player {
namespace {

using decoders::NpyWriter;

struct DumpArguments {
  SourceArguments source;
  std::string output, mask, clip, frame, frames;
  int layers = -1;
  int threads = 1;
};

Status write_mask(const ClipReader& clip, const std::string& path) {
  const int width = clip.model().width, height = clip.model().height;
  std::vector<std::uint8_t> mask(static_cast<std::size_t>(width) *
                                 static_cast<std::size_t>(height));
  RELIT_TRY(decoders::mark_covered_texels(clip.meshes(), width, height, mask));
  const std::uint64_t shape[] = {static_cast<std::uint64_t>(height),
                                 static_cast<std::uint64_t>(width)};
  RELIT_ASSIGN(NpyWriter writer, NpyWriter::create(path, NpyWriter::Type::kUint8, shape));
  RELIT_TRY(writer.write(std::span<const std::uint8_t>(mask)));
  return writer.commit();
}

Status write_frames(ClipReader& clip, const DumpArguments& arguments) {
  const bool several = !arguments.frames.empty();
  RELIT_ASSIGN(const FrameRange range,
               parse_frames(several                   ? arguments.frames
                            : arguments.frame.empty() ? "0"
                                                      : arguments.frame,
                            several ? "--frames" : "--frame", clip.clip().frame_count));
  const auto coefficients =
      static_cast<std::uint64_t>(decoders::coefficient_count(clip.model().order));
  std::vector<std::uint64_t> shape{coefficients, 3, clip.model().height, clip.model().width};
  if (several) shape.insert(shape.begin(), range.last - range.first + 1);
  RELIT_ASSIGN(NpyWriter writer,
               NpyWriter::create(arguments.output, NpyWriter::Type::kFloat32, shape));
  std::vector<float> transfer(coefficients * 3 * clip.model().height * clip.model().width);
  std::optional<decoders::TexelNormals> normals;
  std::vector<glm::vec3> frame_normals;
  if (clip.model().prediction_plane >= 0) {
    RELIT_ASSIGN(normals, decoders::TexelNormals::create(clip.meshes(), clip.model().width,
                                                         clip.model().height));
    frame_normals.resize(std::size_t{clip.model().height} * clip.model().width);
  }
  ClipFrame frame;
  for (std::uint64_t k = range.first; k <= range.last; ++k) {
    RELIT_TRY(clip.frame(k, frame));
    if (normals) normals->compute(frame.pose, frame_normals);
    RELIT_TRY(decoders::reconstruct(frame.planes.planes(), clip.model(), clip.layers(), transfer,
                                    frame_normals));
    RELIT_TRY(writer.write(std::span<const float>(transfer)));
  }
  return writer.commit();
}

int run_dump(const DumpArguments& arguments) {
  if (arguments.output.empty() && arguments.mask.empty()) {
    return report(
        {ErrorCode::kInvalid, "dump: nothing to write; name -o X.npy, --mask M.npy or both"});
  }
  ClipOptions options;
  options.clip = arguments.clip, options.layers = arguments.layers,
  options.threads = arguments.threads, options.sparing = arguments.frames.empty();
  auto clip = open_clip(arguments.source, options);
  if (!clip) return report(clip.error());
  if (!arguments.mask.empty()) {
    if (const Status status = write_mask(*clip, arguments.mask); !status)
      return report(status.error());
  }
  if (!arguments.output.empty()) {
    if (const Status status = write_frames(*clip, arguments); !status)
      return report(status.error());
  }
  return report_loss(clip->loss());
}

}  // namespace

void add_dump(CommandLine& line) {
  Options command = line.add("dump", "write decoded transfer coefficients as NumPy arrays");
  const auto arguments = std::make_shared<DumpArguments>();
  add_source_options(command, arguments->source, "path, - or http(s)://");
  Option frame =
      command.add("--frame", arguments->frame, "one frame: float32 [coefficients][3][H][W]");
  command.add("--frames", arguments->frames, "A-B: float32 [frames][coefficients][3][H][W]")
      .excludes(frame);
  command.add("-o,--output", arguments->output, "the .npy file");
  command.add("--mask", arguments->mask, "also write which texels the mesh owns: uint8 [H][W]");
  command.add("--clip", arguments->clip, "by name or number");
  command.add("--layers", arguments->layers,
              "only the first so many layers; what they lack is zero");
  command.add("--threads", arguments->threads, "of each decoder").range(1, 64);
  command.footer("Example:\n  relit dump man.relit --frames 0-99 -o man.npy --mask mask.npy");
  command.runs([arguments] { return run_dump(*arguments); });
}

}  // namespace relit::player
