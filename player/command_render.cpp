// SPDX-License-Identifier: MIT
#include <charconv>
#include <cstdio>

#include "decoders/npy.hpp"
#include "gles/picture.hpp"
#include "player/command.hpp"
#include "player/gl_backend.hpp"
#include "player/look.hpp"
#include "player/picture_writer.hpp"
#include "player/player.hpp"

namespace relit::player {
namespace {

struct RenderArguments {
  SourceArguments source;
  std::string output, clip, frame, frames, camera, sheet, backend = "egl", composite,
                                                          size = "512x512";
  LightArguments light;
  LookOptions look;
  std::vector<float> position{0, 0, 0};
  double time_s = -1;
  int layers = -1, threads = 0, samples = 4;
  bool lightmap = false;
};

struct Size {
  int width = 0, height = 0;
};

Result<Size> parse_size(const std::string& text, const char* option, int largest) {
  Size size;
  const char* end = text.data() + text.size();
  const auto [x, first] = std::from_chars(text.data(), end, size.width);
  if (first == std::errc() && x != end && *x == 'x') {
    const auto [rest, second] = std::from_chars(x + 1, end, size.height);
    if (second == std::errc() && rest == end && std::min(size.width, size.height) >= 1 &&
        std::max(size.width, size.height) <= largest) {
      return size;
    }
  }
  return fail(ErrorCode::kInvalid, std::string(option) + " " + text +
                                       ": the form is WIDTHxHEIGHT, at most " +
                                       std::to_string(largest) + " each");
}

// The frames that are asked for, as far as the clip's record says; by a time, and unevenly spaced,
// it may be any.
Result<FrameRange> chosen_frames(const RenderArguments& arguments,
                                 const container::ClipRecord& clip) {
  if (!arguments.frames.empty())
    return parse_frames(arguments.frames, "--frames", clip.frame_count);
  if (!arguments.frame.empty()) return parse_frames(arguments.frame, "--frame", clip.frame_count);
  FrameRange range;
  if (arguments.time_s >= 0) {
    const double at = arguments.time_s * static_cast<double>(clip.tick_rate.num) /
                      static_cast<double>(clip.tick_rate.den);
    if (at >= static_cast<double>(clip.duration_ticks)) {
      return fail(ErrorCode::kNotFound,
                  "--time: the clip lasts " + std::to_string(container::duration_s(clip)) + " s");
    }
    // A time that names a tick to within rounding means that tick.
    const auto tick = std::min(static_cast<std::uint64_t>(at + 1e-6), clip.duration_ticks - 1);
    const bool even = clip.duration_ticks == clip.frame_count;
    range.first = even ? tick : 0;
    range.last = even ? tick : clip.frame_count - 1;
    return range;
  }
  const std::string extension = std::filesystem::path(arguments.output).extension().string();
  const bool film = extension == ".mp4" || extension == ".webp" || extension == ".gif" ||
                    !arguments.sheet.empty();
  if (film) range.last = clip.frame_count - 1, range.single = false;
  return range;
}

// As asked for, by --composite or else by the backend.
Result<CompositePath> chosen_path(const RenderArguments& arguments, Backend backend) {
  if (!arguments.composite.empty()) return parse_composite_path(arguments.composite);
  return backend == Backend::kCpu ? CompositePath::kCpu : CompositePath::kTexture;
}

// A player of the frames that were asked for, under the light. Time moves by show() alone.
class Frames {
 public:
  static Result<Frames> open(const RenderArguments& arguments) {
    Frames frames;
    RELIT_ASSIGN(const Backend backend, parse_backend(arguments.backend));
    RELIT_ASSIGN(const CompositePath path, chosen_path(arguments, backend));
    RELIT_TRY(frames.open_player(arguments, path));
    RELIT_ASSIGN(const LoadedLight light, load_light(arguments.light, 3));
    RELIT_TRY(frames.player->set_light(light));
    const std::vector<float>& at = arguments.position;
    frames.player->set_position({at[0], at[1], at[2]});
    if (arguments.lightmap && path == CompositePath::kCpu) return frames;
    RELIT_ASSIGN(GlBackend gl, open_backend(backend));
    frames.context = std::move(gl.context);
    RELIT_TRY(frames.player->attach(std::move(gl.device)));
    return frames;
  }

  Status show(std::uint64_t frame) const {
    for (bool shown = false; !shown;) {
      RELIT_ASSIGN(shown, player->show_frame(frame, kPatience_s));
    }
    return {};
  }

  std::unique_ptr<gles::OffscreenContext> context;  ///< of the player, which goes first
  std::unique_ptr<Player> player;
  container::ClipRecord clip;
  FrameRange range;

 private:
  static constexpr double kPatience_s = 60;

  Status open_player(const RenderArguments& arguments, CompositePath path) {
    PlayerOptions options;
    options.name = source_name(arguments.source.name);
    options.clip = arguments.clip;
    options.layers = arguments.layers, options.threads = arguments.threads;
    options.interpolate = false;
    options.path = path;
    options.governor.quality = 1;
    options.sparing = !arguments.frame.empty() || arguments.time_s >= 0 || arguments.lightmap ||
                      !arguments.sheet.empty();
    options.frames = [&](const container::ClipRecord& opened) -> Result<PlayerFrames> {
      clip = opened;
      RELIT_ASSIGN(range, chosen_frames(arguments, clip));
      return PlayerFrames{range.first, range.last};
    };
    options.log = [](LogLevel level, const std::string& sentence) {
      if (level != LogLevel::kInfo) warn(sentence);
    };
    RELIT_ASSIGN(auto source,
                 open_source(arguments.source, options.sparing || arguments.layers >= 0));
    RELIT_ASSIGN(player, Player::open(std::move(source), options));
    player->set_paused(true);
    return range.single && range.first < range.last ? find(arguments.time_s) : Status();
  }

  // Which frame is shown at a time.
  Status find(double time_s) {
    RELIT_TRY(player->seek(time_s));
    for (bool here = false; !here;) {
      RELIT_ASSIGN(here, player->wait(kPatience_s));
    }
    range.first = range.last = player->moment().frame;
    return {};
  }
};

Status render_lightmap(const RenderArguments& arguments, Frames& frames) {
  const FrameRange& range = frames.range;
  const Player::Size size = frames.player->light_map_size();
  std::vector<std::uint64_t> shape{3, static_cast<std::uint64_t>(size.height),
                                   static_cast<std::uint64_t>(size.width)};
  if (!range.single) shape.insert(shape.begin(), range.last - range.first + 1);
  RELIT_ASSIGN(
      decoders::NpyWriter writer,
      decoders::NpyWriter::create(arguments.output, decoders::NpyWriter::Type::kFloat32, shape));
  std::vector<float> map(std::size_t{3} * static_cast<std::size_t>(size.height) *
                         static_cast<std::size_t>(size.width));
  for (std::uint64_t k = range.first; k <= range.last; ++k) {
    RELIT_TRY(frames.show(k));
    RELIT_TRY(frames.player->read_light_map(map));
    RELIT_TRY(writer.write(std::span<const float>(map)));
  }
  return writer.commit();
}

// Frames as pictures, off the screen.
class PictureRenderer {
 public:
  static Result<PictureRenderer> create(const RenderArguments& arguments, const Frames& frames,
                                        const Look& look, Size size) {
    OrbitCamera camera;
    if (!arguments.camera.empty()) {
      RELIT_ASSIGN(camera, parse_camera(arguments.camera));
    }
    RELIT_ASSIGN(auto framebuffer,
                 gles::Framebuffer::create(*frames.player->device(),
                                           {size.width, size.height, arguments.samples}));
    return PictureRenderer(frames, look, camera, std::move(framebuffer));
  }

  Status draw(std::uint64_t frame, std::span<std::uint8_t> rgba) {
    RELIT_TRY(frames_.show(frame));
    framebuffer_.bind();
    Player& player = *frames_.player;
    RELIT_TRY(player.draw(
        look_at(player, look_, camera_, {framebuffer_.draw_width(), framebuffer_.draw_height()}),
        look_.backdrop));
    RELIT_TRY(framebuffer_.resolve());
    return framebuffer_.read_back(rgba);
  }

 private:
  PictureRenderer(const Frames& frames, const Look& look, const OrbitCamera& camera,
                  gles::Framebuffer framebuffer)
      : frames_(frames), look_(look), camera_(camera), framebuffer_(std::move(framebuffer)) {}

  const Frames& frames_;
  Look look_;
  OrbitCamera camera_;
  gles::Framebuffer framebuffer_;
};

// Pictures side by side in one.
Status render_sheet(const RenderArguments& arguments, PictureRenderer& renderer,
                    const FrameRange& range, Size size) {
  RELIT_ASSIGN(const Size cells, parse_size(arguments.sheet, "--sheet", 64));
  PictureWriter::Options options;
  options.path = arguments.output;
  options.width = cells.width * size.width, options.height = cells.height * size.height;
  RELIT_ASSIGN(auto writer, PictureWriter::create(options));
  const std::size_t row_bytes = 4 * static_cast<std::size_t>(size.width);
  std::vector<std::uint8_t> picture(row_bytes * static_cast<std::size_t>(size.height));
  std::vector<std::uint8_t> sheet(picture.size() * static_cast<std::size_t>(cells.width) *
                                  static_cast<std::size_t>(cells.height));
  const auto count =
      static_cast<std::uint64_t>(cells.width) * static_cast<std::uint64_t>(cells.height);
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint64_t k = range.first + i * (range.last - range.first + 1) / count;
    RELIT_TRY(renderer.draw(k, picture));
    const auto column = i % static_cast<std::uint64_t>(cells.width),
               row = i / static_cast<std::uint64_t>(cells.width);
    for (std::size_t y = 0; y < static_cast<std::size_t>(size.height); ++y) {
      const std::size_t to = ((row * static_cast<std::size_t>(size.height) + y) *
                                  static_cast<std::size_t>(cells.width) +
                              column) *
                             row_bytes;
      std::copy_n(picture.begin() + static_cast<std::ptrdiff_t>(y * row_bytes), row_bytes,
                  sheet.begin() + static_cast<std::ptrdiff_t>(to));
    }
  }
  RELIT_TRY(writer->add(sheet));
  return writer->finish();
}

Status render_pictures(const RenderArguments& arguments, const Frames& frames, const Look& look) {
  RELIT_ASSIGN(const Size size, parse_size(arguments.size, "--size", 8192));
  RELIT_ASSIGN(PictureRenderer renderer, PictureRenderer::create(arguments, frames, look, size));
  const FrameRange& range = frames.range;
  if (!arguments.sheet.empty()) return render_sheet(arguments, renderer, range, size);
  PictureWriter::Options options;
  options.path = arguments.output;
  options.width = size.width, options.height = size.height;
  options.tick_rate = frames.clip.tick_rate;
  options.pictures = range.last - range.first + 1;
  RELIT_ASSIGN(auto writer, PictureWriter::create(options));
  std::vector<std::uint8_t> picture(std::size_t{4} * static_cast<std::size_t>(size.width) *
                                    static_cast<std::size_t>(size.height));
  for (std::uint64_t k = range.first; k <= range.last; ++k) {
    RELIT_TRY(renderer.draw(k, picture));
    RELIT_TRY(writer->add(picture, frames.player->ticks_of(k)));
  }
  return writer->finish();
}

Result<PlaybackLoss> render(const RenderArguments& arguments) {
  RELIT_ASSIGN(const Look look, parse_look(arguments.look));
  RELIT_ASSIGN(Frames frames, Frames::open(arguments));
  RELIT_TRY(arguments.lightmap ? render_lightmap(arguments, frames)
                               : render_pictures(arguments, frames, look));
  return frames.player->stats().loss;
}

int run_render(const RenderArguments& arguments) {
  const auto loss = render(arguments);
  return loss ? report_loss(*loss) : report(loss.error());
}

constexpr const char* kExamples = R"(Examples:
  relit render man.relit --light sky.hdr --frame 12 -o man.png
  relit render man.relit --light sky.hdr -o man.mp4 --size 720x720 --camera orbit:40,10
  relit render man.relit --light sky.hdr --sheet 4x2 -o sheet.png
  relit render man.relit --light sky.json --frame 0 --lightmap --backend cpu -o light.npy)";

}  // namespace

void add_render(CommandLine& line) {
  Options command =
      line.add("render", "relight a clip: pictures, films, contact sheets or the light map itself");
  const auto a = std::make_shared<RenderArguments>();
  add_source_options(command, a->source, "path, - or http(s)://");
  command.add("--light", a->light.path, ".hdr, .exr (equirectangular) or .json").required();
  add_light_options(command, a->light);
  command
      .add("--at", a->position,
           "X,Y,Z: where the character stands among the probes of a light, metres")
      .delimiter(',')
      .expected(3, 3);
  command.add("-o,--output", a->output, ".png, .mp4, .webp, .gif; with --lightmap .npy").required();
  Option frame = command.add("--frame", a->frame, "one frame");
  Option frames = command.add("--frames", a->frames, "A-B").excludes(frame);
  command.add("--time", a->time_s, "the frame shown at so many seconds")
      .excludes(frame)
      .excludes(frames)
      .not_negative();
  command.add("--clip", a->clip, "by name or number");
  command.add("--size", a->size, "of the picture").shows_default();
  add_look_options(command, a->look, a->camera);
  command.add("--backend", a->backend, "egl, egl-es2, egl-es2-mediump, osmesa or cpu")
      .shows_default();
  command.add("--composite", a->composite,
              "where planes are added up: auto, cpu, texture or fused; by default what the "
              "backend says");
  command.add("--layers", a->layers, "only the first so many layers: faster and less accurate");
  command.add("--threads", a->threads, "that decode; 0: one a processor")
      .range(0, 64)
      .shows_default();
  command.add("--samples", a->samples, "a pixel, against jagged edges: 1, 4 or 16")
      .one_of({1, 4, 16})
      .shows_default();
  command.add("--sheet", a->sheet, "COLUMNSxROWS: a contact sheet of evenly spaced frames");
  command.flag("--lightmap", a->lightmap, "write the composite, float32 [3][H][W], not clamped");
  command.footer(kExamples);
  command.runs([a] { return run_render(*a); });
}

}  // namespace relit::player
