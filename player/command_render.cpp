// SPDX-License-Identifier: MIT
#include <charconv>
#include <cstdio>

#include "decoders/npy.hpp"
#include "gles/picture.hpp"
#include "player/command.hpp"
#include "player/gl_backend.hpp"
#include "player/picture_writer.hpp"
#include "player/scene_view.hpp"

namespace relit::player {
namespace {

struct Arguments {
  SourceArguments source;
  std::string output, clip, frame, frames, camera, sheet, backend = "egl", composite,
                                                          size = "512x512";
  LightArguments light;
  ViewOptions view;
  std::vector<float> position{0, 0, 0};
  double time_s = -1;
  int layers = -1, threads = 1, samples = 4;
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

Result<FrameRange> chosen_frames(const Arguments& arguments, ClipReader& reader) {
  const container::ClipRecord& clip = reader.clip();
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
    RELIT_ASSIGN(range.first, reader.frame_at(tick));
    range.last = range.first;
    return range;
  }
  const std::string extension = std::filesystem::path(arguments.output).extension().string();
  const bool film = extension == ".mp4" || extension == ".webp" || extension == ".gif" ||
                    !arguments.sheet.empty();
  if (film) range.last = clip.frame_count - 1, range.single = false;
  return range;
}

// As asked for, by --composite or else by the backend.
Result<CompositePath> chosen_path(const Arguments& arguments, Backend backend) {
  if (!arguments.composite.empty()) return parse_composite_path(arguments.composite);
  return backend == Backend::kCpu ? CompositePath::kCpu : CompositePath::kTexture;
}

// A light that varies, at the frames of a clip.
class LightOfFrame {
 public:
  LightOfFrame(const Arguments& arguments, const LoadedLight& light, const ClipReader& clip)
      : light_(light),
        clip_(clip),
        position_(arguments.position[0], arguments.position[1], arguments.position[2]) {}

  // Of a frame that the clip has given; null where the light does not vary.
  const decoders::Light* at(std::uint64_t frame) {
    if (!light_.field) return nullptr;
    const container::Rational& rate = clip_.clip().tick_rate;
    const double time_s = static_cast<double>(clip_.first_tick(frame)) *
                          static_cast<double>(rate.den) / static_cast<double>(rate.num);
    light_.field->sample(time_s, position_, now_);
    return &now_;
  }

 private:
  const LoadedLight& light_;
  const ClipReader& clip_;
  glm::vec3 position_;
  decoders::Light now_;
};

Status render_lightmap(const Arguments& arguments, ClipReader& clip, const LoadedLight& light,
                       Backend backend) {
  GlBackend gl;
  RELIT_ASSIGN(const CompositePath path, chosen_path(arguments, backend));
  if (path != CompositePath::kCpu) {
    RELIT_ASSIGN(gl, open_backend(backend));
  }
  RELIT_ASSIGN(auto relighter,
               Relighter::create(clip.model(), clip.layers(), {gl.device.get(), path}));
  RELIT_TRY(relighter->set_light(light.light, decoded_layers(clip, arguments.layers)));
  RELIT_ASSIGN(const FrameRange range, chosen_frames(arguments, clip));
  std::vector<std::uint64_t> shape{3, clip.model().height, clip.model().width};
  if (!range.single) shape.insert(shape.begin(), range.last - range.first + 1);
  RELIT_ASSIGN(
      decoders::NpyWriter writer,
      decoders::NpyWriter::create(arguments.output, decoders::NpyWriter::Type::kFloat32, shape));
  std::vector<float> map(std::size_t{3} * clip.model().height * clip.model().width);
  ClipFrame frame;
  LightOfFrame varied(arguments, light, clip);
  for (std::uint64_t k = range.first; k <= range.last; ++k) {
    RELIT_TRY(clip.frame(k, frame));
    if (const decoders::Light* now = varied.at(k))
      RELIT_TRY(relighter->set_light(*now, decoded_layers(clip, arguments.layers)));
    RELIT_TRY(relighter->composite({&frame.planes}));
    RELIT_TRY(relighter->read(map));
    RELIT_TRY(writer.write(std::span<const float>(map)));
  }
  return writer.commit();
}

// A scene off the screen.
class PictureRenderer {
 public:
  static Result<std::unique_ptr<PictureRenderer>> create(const Arguments& arguments,
                                                         const ClipReader& clip,
                                                         const LoadedLight& light, Backend backend,
                                                         Size size) {
    std::unique_ptr<PictureRenderer> self(new PictureRenderer);
    ViewOptions options = arguments.view;
    options.layers = arguments.layers;
    RELIT_ASSIGN(options.composite, chosen_path(arguments, backend));
    if (!arguments.camera.empty()) {
      RELIT_ASSIGN(options.camera, parse_camera(arguments.camera));
    }
    self->camera_ = options.camera;
    RELIT_ASSIGN(self->gl_, open_backend(backend));
    RELIT_ASSIGN(self->scene_, SceneView::create(clip, *self->gl_.device, options));
    for (const std::string& warning : self->scene_->warnings())
      std::fprintf(stderr, "relit: warning: %s\n", warning.c_str());
    RELIT_TRY(self->scene_->set_light(light));
    RELIT_ASSIGN(
        auto framebuffer,
        gles::Framebuffer::create(*self->gl_.device, {size.width, size.height, arguments.samples}));
    self->framebuffer_ = std::make_unique<gles::Framebuffer>(std::move(framebuffer));
    return self;
  }

  // `light` null: as it was.
  Status draw(const ClipFrame& frame, const decoders::Light* light, std::span<std::uint8_t> rgba) {
    if (light != nullptr) RELIT_TRY(scene_->vary_light(*light));
    RELIT_TRY(scene_->set_frame(frame));
    framebuffer_->bind();
    RELIT_TRY(scene_->draw(camera_, framebuffer_->draw_width(), framebuffer_->draw_height()));
    RELIT_TRY(framebuffer_->resolve());
    return framebuffer_->read_back(rgba);
  }

 private:
  PictureRenderer() = default;

  GlBackend gl_;  // goes last
  std::unique_ptr<SceneView> scene_;
  std::unique_ptr<gles::Framebuffer> framebuffer_;
  OrbitCamera camera_;
};

// Pictures side by side in one.
Status render_sheet(const Arguments& arguments, ClipReader& clip, PictureRenderer& renderer,
                    LightOfFrame& light, const FrameRange& range, Size size) {
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
  ClipFrame frame;
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint64_t k = range.first + i * (range.last - range.first + 1) / count;
    RELIT_TRY(clip.frame(k, frame));
    RELIT_TRY(renderer.draw(frame, light.at(k), picture));
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

Status render_pictures(const Arguments& arguments, ClipReader& clip, const LoadedLight& light,
                       Backend backend) {
  RELIT_ASSIGN(const Size size, parse_size(arguments.size, "--size", 8192));
  RELIT_ASSIGN(const FrameRange range, chosen_frames(arguments, clip));
  RELIT_ASSIGN(auto renderer, PictureRenderer::create(arguments, clip, light, backend, size));
  LightOfFrame varied(arguments, light, clip);
  if (!arguments.sheet.empty())
    return render_sheet(arguments, clip, *renderer, varied, range, size);
  PictureWriter::Options options;
  options.path = arguments.output;
  options.width = size.width, options.height = size.height;
  options.tick_rate = clip.clip().tick_rate;
  options.pictures = range.last - range.first + 1;
  RELIT_ASSIGN(auto writer, PictureWriter::create(options));
  std::vector<std::uint8_t> picture(std::size_t{4} * static_cast<std::size_t>(size.width) *
                                    static_cast<std::size_t>(size.height));
  ClipFrame frame;
  for (std::uint64_t k = range.first; k <= range.last; ++k) {
    RELIT_TRY(clip.frame(k, frame));
    RELIT_TRY(renderer->draw(frame, varied.at(k), picture));
    RELIT_TRY(writer->add(picture, clip.ticks_of(k)));
  }
  return writer->finish();
}

Status render(const Arguments& arguments, ClipReader& clip) {
  RELIT_ASSIGN(const Backend backend, parse_backend(arguments.backend));
  RELIT_ASSIGN(const LoadedLight light, load_light(arguments.light, 3));
  if (arguments.lightmap) return render_lightmap(arguments, clip, light, backend);
  return render_pictures(arguments, clip, light, backend);
}

int run(const Arguments& arguments) {
  ClipOptions options;
  options.clip = arguments.clip, options.layers = arguments.layers,
  options.threads = arguments.threads;
  options.sparing = !arguments.frame.empty() || arguments.time_s >= 0 || arguments.lightmap ||
                    !arguments.sheet.empty();
  auto clip = open_clip(arguments.source, options);
  if (!clip) return report(clip.error());
  if (const Status status = render(arguments, *clip); !status) return report(status.error());
  return report_loss(clip->loss());
}

constexpr const char* kExamples = R"(Examples:
  relit render man.relit --light sky.hdr --frame 12 -o man.png
  relit render man.relit --light sky.hdr -o man.mp4 --size 720x720 --camera orbit:40,10
  relit render man.relit --light sky.hdr --sheet 4x2 -o sheet.png
  relit render man.relit --light sky.json --frame 0 --lightmap --backend cpu -o light.npy)";

}  // namespace

Command add_render(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "render", "relight a clip: pictures, films, contact sheets or the light map itself");
  const auto a = std::make_shared<Arguments>();
  add_source_options(*command, a->source, "path, - or http(s)://");
  command->add_option("--light", a->light.path, ".hdr, .exr (equirectangular) or .json")
      ->required();
  add_light_options(*command, a->light);
  command
      ->add_option("--at", a->position,
                   "X,Y,Z: where the character stands among the probes of a light, metres")
      ->delimiter(',')
      ->expected(3);
  command->add_option("-o,--output", a->output, ".png, .mp4, .webp, .gif; with --lightmap .npy")
      ->required();
  auto* frame = command->add_option("--frame", a->frame, "one frame");
  auto* frames = command->add_option("--frames", a->frames, "A-B")->excludes(frame);
  command->add_option("--time", a->time_s, "the frame shown at so many seconds")
      ->excludes(frame)
      ->excludes(frames)
      ->check(CLI::NonNegativeNumber);
  command->add_option("--clip", a->clip, "by name or number");
  command->add_option("--size", a->size, "of the picture")->capture_default_str();
  add_view_options(*command, a->view, a->camera);
  command->add_option("--backend", a->backend, "egl, egl-es2, egl-es2-mediump, osmesa or cpu")
      ->capture_default_str();
  command->add_option("--composite", a->composite,
                      "where planes are added up: auto, cpu, texture or fused; by default what the "
                      "backend says");
  command->add_option("--layers", a->layers,
                      "only the first so many layers: faster and less accurate");
  command->add_option("--threads", a->threads, "of each decoder")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  command->add_option("--samples", a->samples, "a pixel, against jagged edges: 1, 4 or 16")
      ->check(CLI::IsMember({1, 4, 16}))
      ->capture_default_str();
  command->add_option("--sheet", a->sheet, "COLUMNSxROWS: a contact sheet of evenly spaced frames");
  command->add_flag("--lightmap", a->lightmap,
                    "write the composite, float32 [3][H][W], not clamped");
  command->footer(kExamples);
  return [a] { return run(*a); };
}

}  // namespace relit::player
