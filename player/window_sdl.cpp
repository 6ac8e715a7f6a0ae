// SPDX-License-Identifier: MIT
#include <SDL2/SDL.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "gles/picture.hpp"
#include "player/picture_writer.hpp"
#include "player/window.hpp"

namespace relit::player {

const char* const kWindowHelp = R"(In the window:
  drag                 turn the camera          wheel        nearer, farther
  shift+drag or right  turn the light           L            the next light
  space                pause                    left, right  one frame back, on
  + -                  exposure                 F            full screen
  S                    a screenshot             Escape, Q    leave)";

namespace {

using Clock = std::chrono::steady_clock;

struct SdlQuit {
  ~SdlQuit() { SDL_Quit(); }
};

struct WindowDelete {
  void operator()(SDL_Window* window) const { SDL_DestroyWindow(window); }
};

struct ContextDelete {
  void operator()(void* context) const { SDL_GL_DeleteContext(context); }
};

Unexpected no_window(const char* what) {
  return fail(ErrorCode::kEnvironment,
              std::string("play: ") + what + ": " + SDL_GetError() +
                  "; `relit render` writes pictures and films without a display");
}

class Window {
 public:
  Window(ClipReader& clip, std::span<const LoadedLight> lights, const WindowOptions& options)
      : clip_(clip), lights_(lights), options_(options), camera_(options.view.camera) {}

  Status run() {
    RELIT_TRY(open());
    last_tick_ = Clock::now();
    while (!leave_) {
      SDL_Event event;
      while (SDL_PollEvent(&event) != 0) handle(event);
      advance_clock();
      RELIT_TRY(show());
      if (options_.max_shown != 0 && shown_ >= options_.max_shown) break;
    }
    return {};
  }

 private:
  Status open();
  Status open_context(bool es3);
  void handle(const SDL_Event& event);
  void handle_key(SDL_Keycode key);
  void handle_motion(const SDL_MouseMotionEvent& motion);
  void advance_clock();
  void step(int frames);
  Status show();
  Status update();
  Status screenshot();
  void update_title();

  [[nodiscard]] double ticks_per_s() const {
    return static_cast<double>(clip_.clip().tick_rate.num) /
           static_cast<double>(clip_.clip().tick_rate.den);
  }

  ClipReader& clip_;
  std::span<const LoadedLight> lights_;
  const WindowOptions& options_;
  OrbitCamera camera_;
  // Destroyed from the last to the first: GL objects before the context, SDL at the very end.
  SdlQuit quit_;
  std::unique_ptr<SDL_Window, WindowDelete> window_;
  std::unique_ptr<void, ContextDelete> context_;
  std::unique_ptr<gles::Device> device_;
  std::unique_ptr<SceneView> scene_;
  ClipFrame frame_;

  Clock::time_point last_tick_;
  double position_ = 0;  // in ticks
  std::uint64_t shown_frame_ = ~std::uint64_t{0};
  std::size_t light_ = 0;
  double light_turn_rad_ = 0;
  std::uint64_t shown_ = 0, counted_ = 0;
  Clock::time_point counted_since_ = Clock::now();
  double shown_per_s_ = 0;
  bool paused_ = false, leave_ = false, fullscreen_ = false;
  bool light_changed_ = true, light_turned_ = false, redraw_ = true, want_screenshot_ = false;
};

Status Window::open_context(bool es3) {
  SDL_GL_SetAttribute(SDL_GL_CONTEXT_PROFILE_MASK, SDL_GL_CONTEXT_PROFILE_ES);
  SDL_GL_SetAttribute(SDL_GL_CONTEXT_MAJOR_VERSION, es3 ? 3 : 2);
  SDL_GL_SetAttribute(SDL_GL_CONTEXT_MINOR_VERSION, 0);
  SDL_GL_SetAttribute(SDL_GL_DEPTH_SIZE, 24);
  SDL_GL_SetAttribute(SDL_GL_MULTISAMPLEBUFFERS, 1);
  SDL_GL_SetAttribute(SDL_GL_MULTISAMPLESAMPLES, 4);
  const Uint32 flags = SDL_WINDOW_OPENGL | SDL_WINDOW_RESIZABLE | SDL_WINDOW_ALLOW_HIGHDPI;
  const auto create = [&] {
    window_.reset(SDL_CreateWindow("relit", SDL_WINDOWPOS_CENTERED, SDL_WINDOWPOS_CENTERED,
                                   options_.width, options_.height, flags));
    context_.reset(window_ ? SDL_GL_CreateContext(window_.get()) : nullptr);
  };
  create();
  if (!context_) {
    // Not every driver has multisampled windows.
    SDL_GL_SetAttribute(SDL_GL_MULTISAMPLEBUFFERS, 0);
    SDL_GL_SetAttribute(SDL_GL_MULTISAMPLESAMPLES, 0);
    create();
  }
  if (!context_) return no_window(window_ ? "no OpenGL ES context" : "no window");
  gles::DeviceOptions device;
  device.get_proc_address = [](const char* name) { return SDL_GL_GetProcAddress(name); };
  if (!es3) device.profile = gles::Profile::kEs2;
  RELIT_ASSIGN(device_, gles::Device::create(device));
  return {};
}

Status Window::open() {
  if (SDL_Init(SDL_INIT_VIDEO) != 0) return no_window("no display");
  // SDL's dummy drivers show nothing to anybody.
  const char* driver = SDL_GetCurrentVideoDriver();
  if (driver == nullptr || std::string(driver) == "dummy" || std::string(driver) == "offscreen") {
    SDL_SetError("SDL found only the driver \"%s\"", driver != nullptr ? driver : "none");
    return no_window("no display");
  }
  Status opened = options_.es2 ? open_context(false) : open_context(true);
  if (!opened && !options_.es2) opened = open_context(false);
  RELIT_TRY(opened);
  SDL_GL_SetSwapInterval(1);
  RELIT_ASSIGN(scene_, SceneView::create(clip_, *device_, options_.view));
  for (const std::string& warning : scene_->warnings())
    std::fprintf(stderr, "relit: warning: %s\n", warning.c_str());
  if (camera_.distance <= 0) {
    const auto& low = clip_.clip().bounds_min;
    const auto& high = clip_.clip().bounds_max;
    const glm::vec3 size(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
    camera_.distance = 0.5 * static_cast<double>(glm::length(size)) /
                       std::sin(glm::radians(0.5 * camera_.field_of_view_deg));
  }
  return {};
}

void Window::handle(const SDL_Event& event) {
  switch (event.type) {
    case SDL_QUIT:
      leave_ = true;
      break;
    case SDL_KEYDOWN:
      handle_key(event.key.keysym.sym);
      break;
    case SDL_MOUSEMOTION:
      handle_motion(event.motion);
      break;
    case SDL_MOUSEWHEEL:
      camera_.distance = std::clamp(camera_.distance * std::pow(0.9, event.wheel.y), 1e-3, 1e6);
      redraw_ = true;
      break;
    case SDL_WINDOWEVENT:
      redraw_ = true;
      break;
    default:
      break;
  }
}

void Window::handle_key(SDL_Keycode key) {
  redraw_ = true;
  switch (key) {
    case SDLK_ESCAPE:
    case SDLK_q:
      leave_ = true;
      break;
    case SDLK_SPACE:
      paused_ = !paused_;
      break;
    case SDLK_LEFT:
      step(-1);
      break;
    case SDLK_RIGHT:
      step(1);
      break;
    case SDLK_l:
      light_ = (light_ + 1) % lights_.size();
      light_turn_rad_ = 0;
      light_changed_ = true;
      break;
    case SDLK_PLUS:
    case SDLK_EQUALS:
    case SDLK_KP_PLUS:
      scene_->scale_exposure(1.1892071f);  // a quarter of a stop
      break;
    case SDLK_MINUS:
    case SDLK_KP_MINUS:
      scene_->scale_exposure(1 / 1.1892071f);
      break;
    case SDLK_f:
      fullscreen_ = !fullscreen_;
      SDL_SetWindowFullscreen(window_.get(), fullscreen_ ? SDL_WINDOW_FULLSCREEN_DESKTOP : 0);
      break;
    case SDLK_s:
      want_screenshot_ = true;
      break;
    default:
      break;
  }
}

void Window::handle_motion(const SDL_MouseMotionEvent& motion) {
  const bool left = (motion.state & SDL_BUTTON_LMASK) != 0,
             right = (motion.state & SDL_BUTTON_RMASK) != 0;
  if (!left && !right) return;
  constexpr double kDegreesPerPixel = 0.4;
  if (right || (SDL_GetModState() & KMOD_SHIFT) != 0) {
    light_turn_rad_ += glm::radians(kDegreesPerPixel * motion.xrel);
    light_turned_ = true;
    return;
  }
  camera_.azimuth_deg -= kDegreesPerPixel * motion.xrel;
  camera_.elevation_deg =
      std::clamp(camera_.elevation_deg + kDegreesPerPixel * motion.yrel, -89.0, 89.0);
  redraw_ = true;
}

// To the frame before or behind the one that is shown, around the ends.
void Window::step(int frames) {
  paused_ = true;
  const std::uint64_t count = clip_.clip().duration_ticks, start = clip_.first_tick(shown_frame_);
  position_ = static_cast<double>(
      (frames > 0 ? start + clip_.ticks_of(shown_frame_) : start + count - 1) % count);
}

void Window::advance_clock() {
  const Clock::time_point now = Clock::now();
  const double elapsed_s = std::chrono::duration<double>(now - last_tick_).count();
  last_tick_ = now;
  if (paused_) return;
  const auto count = static_cast<double>(clip_.clip().duration_ticks);
  position_ += elapsed_s * ticks_per_s();
  position_ = clip_.clip().loop ? std::fmod(position_, count) : std::min(position_, count - 1);
}

// Brings the scene up to the frame and the light of the moment.
Status Window::update() {
  RELIT_ASSIGN(const std::uint64_t wanted, clip_.frame_at(static_cast<std::uint64_t>(position_)));
  const bool new_frame = wanted != shown_frame_;
  if (!new_frame && !light_changed_ && !light_turned_) return {};
  if (light_changed_) RELIT_TRY(scene_->set_light(lights_[light_]));
  if (light_turned_) RELIT_TRY(scene_->turn_light(lights_[light_], light_turn_rad_));
  light_changed_ = light_turned_ = false;
  if (new_frame) RELIT_TRY(clip_.frame(wanted, frame_));
  shown_frame_ = wanted;
  RELIT_TRY(scene_->set_frame(frame_));
  redraw_ = true;
  return {};
}

Status Window::show() {
  RELIT_TRY(update());
  if (!redraw_) {
    SDL_Delay(2);
    return {};
  }
  redraw_ = false;
  int width = 0, height = 0;
  SDL_GL_GetDrawableSize(window_.get(), &width, &height);
  if (width < 1 || height < 1) return {};
  RELIT_TRY(scene_->draw(camera_, width, height));
  if (want_screenshot_) RELIT_TRY(screenshot());
  SDL_GL_SwapWindow(window_.get());
  ++shown_, ++counted_;
  update_title();
  return {};
}

// The picture as it stands, drawn again off the screen, under the first number that is free.
Status Window::screenshot() {
  want_screenshot_ = false;
  int width = 0, height = 0;
  SDL_GL_GetDrawableSize(window_.get(), &width, &height);
  RELIT_ASSIGN(gles::Framebuffer framebuffer,
               gles::Framebuffer::create(*device_, {width, height, 4}));
  GLint screen = 0;
  device_->gl().GetIntegerv(GL_FRAMEBUFFER_BINDING, &screen);
  framebuffer.bind();
  RELIT_TRY(scene_->draw(camera_, framebuffer.draw_width(), framebuffer.draw_height()));
  RELIT_TRY(framebuffer.resolve());
  std::vector<std::uint8_t> rgba(std::size_t{4} * static_cast<std::size_t>(width) *
                                 static_cast<std::size_t>(height));
  RELIT_TRY(framebuffer.read_back(rgba));
  device_->gl().BindFramebuffer(GL_FRAMEBUFFER, static_cast<GLuint>(screen));
  PictureWriter::Options options;
  options.width = width, options.height = height;
  for (int number = 1; number < 10000; ++number) {
    char name[32];
    std::snprintf(name, sizeof name, "relit-%04d.png", number);
    options.path = name;
    if (!std::filesystem::exists(options.path)) break;
  }
  RELIT_ASSIGN(auto writer, PictureWriter::create(options));
  RELIT_TRY(writer->add(rgba));
  RELIT_TRY(writer->finish());
  std::fprintf(stderr, "relit: %s\n", options.path.c_str());
  return {};
}

void Window::update_title() {
  const double elapsed_s = std::chrono::duration<double>(Clock::now() - counted_since_).count();
  if (elapsed_s < 0.5) return;
  shown_per_s_ = static_cast<double>(counted_) / elapsed_s;
  counted_ = 0, counted_since_ = Clock::now();
  char title[256];
  std::snprintf(title, sizeof title, "%s: %s, frame %llu of %llu, %.0f pictures/s, light %s",
                options_.title.c_str(), clip_.clip().name.c_str(),
                static_cast<unsigned long long>(shown_frame_),
                static_cast<unsigned long long>(clip_.clip().frame_count), shown_per_s_,
                lights_[light_].name.c_str());
  SDL_SetWindowTitle(window_.get(), title);
}

}  // namespace

Status play_in_window(ClipReader& clip, std::span<const LoadedLight> lights,
                      const WindowOptions& options) {
  return Window(clip, lights, options).run();
}

}  // namespace relit::player
