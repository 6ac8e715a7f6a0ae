// SPDX-License-Identifier: MIT
#include <charconv>
#include <cmath>
#include <cstdio>

#include "decoders/npy.hpp"
#include "gles/picture.hpp"
#include "player/camera.hpp"
#include "player/character.hpp"
#include "player/command.hpp"
#include "player/picture_writer.hpp"
#include "player/relighter.hpp"

namespace relit::player {
namespace {

struct Arguments {
  std::string source, output, clip, frame, frames, camera, exposure = "auto", background = "light",
                                                           sheet;
  std::string backend = "egl", size = "512x512", tone = "neutral";
  LightArguments light;
  double time_s = -1, blur_deg = 0;
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

double luminance(const std::array<double, 3>& rgb) {
  return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

// The exposure under which a mid-grey surface in the mean of the light comes out as mid-grey, a
// little up.
Result<float> choose_exposure(const std::string& text, const decoders::Light& light) {
  if (text == "auto") {
    const double mean = luminance(light.sh.front()) * 0.28209479177387814;
    return mean > 0 ? static_cast<float>(0.8 / mean) : 1.0f;
  }
  double stops = 0;
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), stops);
  if (error != std::errc() || rest != text.data() + text.size() || !(std::abs(stops) <= 60)) {
    return fail(
        ErrorCode::kInvalid,
        "--exposure " + text + ": it must be auto, or stops such as -1.5 (radiance × 2^stops)");
  }
  return static_cast<float>(std::exp2(stops));
}

Result<gles::ToneMap> parse_tone(const std::string& text) {
  if (text == "linear") return gles::ToneMap::kLinear;
  if (text == "filmic") return gles::ToneMap::kFilmic;
  if (text == "neutral") return gles::ToneMap::kNeutral;
  return fail(ErrorCode::kInvalid, "--tone-map " + text + ": it must be neutral, filmic or linear");
}

// Turned lights: the coefficients were turned when they were loaded, the picture turns on drawing.
Status set_background(const Arguments& arguments, const LoadedLight& light,
                      gles::BackgroundRenderer& renderer) {
  gles::Background background;
  std::vector<std::array<float, 3>> harmonics;
  const std::string& kind = arguments.background;
  if (kind == "light" && light.environment) {
    background.kind = gles::Background::Kind::kEnvironment;
    background.environment = {light.environment->width, light.environment->height,
                              light.environment->rgb};
    background.blur_rad = static_cast<float>(glm::radians(arguments.blur_deg));
    background.max_side = 512;
    renderer.set_rotation(static_cast<float>(light.environment_rotation_rad));
  } else if (kind == "light" || kind == "sh") {
    background.kind = gles::Background::Kind::kHarmonics;
    for (const auto& row : light.light.sh) {
      harmonics.push_back(
          {static_cast<float>(row[0]), static_cast<float>(row[1]), static_cast<float>(row[2])});
    }
    background.harmonics = harmonics;
  } else if (kind.size() == 7 && kind[0] == '#' &&
             kind.find_first_not_of("0123456789abcdefABCDEF", 1) == std::string::npos) {
    background.kind = gles::Background::Kind::kColor;
    for (std::size_t c = 0; c < 3; ++c) {
      background.top[c] =
          static_cast<float>(std::stoi(kind.substr(1 + 2 * c, 2), nullptr, 16)) / 255.0f;
    }
  } else if (kind != "none") {
    return fail(
        ErrorCode::kInvalid,
        "--background " + kind + ": it must be light, sh, none or a colour such as #202428");
  }
  return renderer.set(background);
}

Result<FrameRange> chosen_frames(const Arguments& arguments, const container::ClipRecord& clip) {
  if (!arguments.frames.empty())
    return parse_frames(arguments.frames, "--frames", clip.frame_count);
  if (!arguments.frame.empty()) return parse_frames(arguments.frame, "--frame", clip.frame_count);
  FrameRange range;
  if (arguments.time_s >= 0) {
    const double at = arguments.time_s * static_cast<double>(clip.frame_rate.num) /
                      static_cast<double>(clip.frame_rate.den);
    // A time that names a frame to within rounding means that frame.
    if (at < static_cast<double>(clip.frame_count)) {
      range.first = range.last = static_cast<std::uint64_t>(at + 1e-6);
      return range;
    }
    return fail(ErrorCode::kNotFound, "--time: the clip lasts " +
                                          std::to_string(static_cast<double>(clip.frame_count) *
                                                         static_cast<double>(clip.frame_rate.den) /
                                                         static_cast<double>(clip.frame_rate.num)) +
                                          " s");
  }
  const std::string extension = std::filesystem::path(arguments.output).extension().string();
  const bool film = extension == ".mp4" || extension == ".webp" || extension == ".gif" ||
                    !arguments.sheet.empty();
  if (film) range.last = clip.frame_count - 1, range.single = false;
  return range;
}

std::vector<std::uint8_t> decoded_layers(const ClipReader& clip, int layers) {
  std::vector<std::uint8_t> decoded(clip.layers().size(), 1);
  for (std::size_t l = 0; l < decoded.size(); ++l) {
    if (layers >= 0 && l >= static_cast<std::size_t>(layers)) decoded[l] = 0;
  }
  return decoded;
}

Status render_lightmap(const Arguments& arguments, ClipReader& clip, const LoadedLight& light,
                       Backend backend) {
  GlBackend gl;
  if (backend != Backend::kCpu) {
    RELIT_ASSIGN(gl, open_backend(backend));
  }
  RELIT_ASSIGN(auto relighter, Relighter::create(clip.model(), clip.layers(), gl.device.get(),
                                                 backend != Backend::kCpu));
  RELIT_TRY(relighter->set_light(light.light, decoded_layers(clip, arguments.layers)));
  RELIT_ASSIGN(const FrameRange range, chosen_frames(arguments, clip.clip()));
  std::vector<std::uint64_t> shape{3, clip.model().height, clip.model().width};
  if (!range.single) shape.insert(shape.begin(), range.last - range.first + 1);
  RELIT_ASSIGN(
      decoders::NpyWriter writer,
      decoders::NpyWriter::create(arguments.output, decoders::NpyWriter::Type::kFloat32, shape));
  std::vector<float> map(std::size_t{3} * clip.model().height * clip.model().width);
  ClipFrame frame;
  for (std::uint64_t k = range.first; k <= range.last; ++k) {
    RELIT_TRY(clip.frame(k, frame));
    RELIT_TRY(relighter->composite(frame.planes));
    RELIT_TRY(relighter->read(map));
    RELIT_TRY(writer.write(std::span<const float>(map)));
  }
  return writer.commit();
}

// Everything that draws a frame of a clip into a picture.
class PictureRenderer {
 public:
  static Result<std::unique_ptr<PictureRenderer>> create(const Arguments& arguments,
                                                         const ClipReader& clip,
                                                         const LoadedLight& light, Backend backend,
                                                         Size size) {
    std::unique_ptr<PictureRenderer> self(new PictureRenderer);
    RELIT_ASSIGN(self->gl_, open_backend(backend));
    const gles::Device& device = *self->gl_.device;
    RELIT_ASSIGN(self->relighter_,
                 Relighter::create(clip.model(), clip.layers(), &device, backend != Backend::kCpu));
    RELIT_TRY(self->relighter_->set_light(light.light, decoded_layers(clip, arguments.layers)));
    RELIT_ASSIGN(self->character_, Character::create(clip, device));
    for (const std::string& warning : self->character_->warnings())
      std::fprintf(stderr, "relit: warning: %s\n", warning.c_str());
    RELIT_TRY(set_background(arguments, light, self->character_->renderer().background()));
    RELIT_ASSIGN(auto framebuffer,
                 gles::Framebuffer::create(device, {size.width, size.height, arguments.samples}));
    self->framebuffer_ = std::make_unique<gles::Framebuffer>(std::move(framebuffer));
    RELIT_TRY(self->set_view(arguments, clip, light));
    return self;
  }

  Status draw(const ClipFrame& frame, std::span<std::uint8_t> rgba) {
    RELIT_TRY(relighter_->composite(frame.planes));
    RELIT_ASSIGN(const gles::LightMap light_map, relighter_->texture());
    RELIT_TRY(character_->pose(frame.pose));
    framebuffer_->bind();
    RELIT_TRY(character_->renderer().draw(view_, light_map));
    RELIT_TRY(framebuffer_->resolve());
    return framebuffer_->read_back(rgba);
  }

 private:
  PictureRenderer() = default;

  Status set_view(const Arguments& arguments, const ClipReader& clip, const LoadedLight& light) {
    OrbitCamera camera;
    if (!arguments.camera.empty()) {
      RELIT_ASSIGN(camera, parse_camera(arguments.camera));
    }
    const auto& low = clip.clip().bounds_min;
    const auto& high = clip.clip().bounds_max;
    const double aspect = static_cast<double>(framebuffer_->width()) / framebuffer_->height();
    const CameraMatrices matrices =
        camera_matrices(camera, {low[0], low[1], low[2]}, {high[0], high[1], high[2]}, aspect);
    view_.view = matrices.view, view_.projection = matrices.projection;
    RELIT_ASSIGN(view_.exposure, choose_exposure(arguments.exposure, light.light));
    RELIT_ASSIGN(view_.tone_map, parse_tone(arguments.tone));
    view_.width = framebuffer_->draw_width(), view_.height = framebuffer_->draw_height();
    return {};
  }

  GlBackend gl_;
  std::unique_ptr<Relighter> relighter_;
  std::unique_ptr<Character> character_;
  std::unique_ptr<gles::Framebuffer> framebuffer_;
  gles::View view_;
};

// Pictures side by side in one.
Status render_sheet(const Arguments& arguments, ClipReader& clip, PictureRenderer& renderer,
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
  ClipFrame frame;
  for (std::uint64_t i = 0; i < count; ++i) {
    RELIT_TRY(clip.frame(range.first + i * (range.last - range.first + 1) / count, frame));
    RELIT_TRY(renderer.draw(frame, picture));
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
  RELIT_ASSIGN(const FrameRange range, chosen_frames(arguments, clip.clip()));
  RELIT_ASSIGN(auto renderer, PictureRenderer::create(arguments, clip, light, backend, size));
  if (!arguments.sheet.empty()) return render_sheet(arguments, clip, *renderer, range, size);
  PictureWriter::Options options;
  options.path = arguments.output;
  options.width = size.width, options.height = size.height;
  options.frame_rate = clip.clip().frame_rate;
  options.pictures = range.last - range.first + 1;
  RELIT_ASSIGN(auto writer, PictureWriter::create(options));
  std::vector<std::uint8_t> picture(std::size_t{4} * static_cast<std::size_t>(size.width) *
                                    static_cast<std::size_t>(size.height));
  ClipFrame frame;
  for (std::uint64_t k = range.first; k <= range.last; ++k) {
    RELIT_TRY(clip.frame(k, frame));
    RELIT_TRY(renderer->draw(frame, picture));
    RELIT_TRY(writer->add(picture));
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
  command->add_option("source", a->source, "path, - or http(s)://")->required();
  command->add_option("--light", a->light.path, ".hdr, .exr (equirectangular) or .json")
      ->required();
  add_light_options(*command, a->light);
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
  command->add_option("--camera", a->camera,
                      "orbit:AZIMUTH,ELEVATION[,DISTANCE], degrees and metres");
  command->add_option("--exposure", a->exposure, "auto, or stops: radiance × 2^stops")
      ->capture_default_str();
  command->add_option("--tone-map", a->tone, "neutral, filmic or linear")->capture_default_str();
  command->add_option("--background", a->background, "light, sh, none (transparent) or #rrggbb")
      ->capture_default_str();
  command->add_option("--background-blur", a->blur_deg, "soft focus of the background, degrees")
      ->check(CLI::Range(0.0, 90.0));
  command->add_option("--backend", a->backend, "egl, egl-es2, egl-es2-mediump, osmesa or cpu")
      ->capture_default_str();
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
