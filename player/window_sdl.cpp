// SPDX-License-Identifier: MIT
#include <SDL2/SDL.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "gles/overlay.hpp"
#include "player/window.hpp"
#include "player/window_input.hpp"
#include "player/window_screenshot.hpp"
#include "player/window_sdl_events.hpp"
#include "player/window_session.hpp"

namespace relit::player {

std::string window_help() {
  std::string text = "In the window:";
  for (const KeyHelp& entry : key_help()) {
    if (entry.keys == nullptr) {
      text += std::string("\n ") + entry.what + ":";
      continue;
    }
    // Arrows are three bytes and one column.
    std::size_t columns = 0;
    for (const char* c = entry.keys; *c != 0; ++c) columns += (*c & 0xC0) != 0x80 ? 1 : 0;
    text += std::string("\n  ") + entry.keys + std::string(columns < 22 ? 22 - columns : 1, ' ') +
            entry.what;
  }
  return text + "\nDrop a .relit on the window to play it, an .hdr, .exr or .json to light it.";
}

namespace {

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

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

class Window {
 public:
  explicit Window(const WindowOptions& options) : options_(options) {}
  Status open();
  Status run();
  [[nodiscard]] PlaybackLoss loss() const { return session_->loss(); }

 private:
  Status open_context(bool es3);
  void handle(const SDL_Event& event);
  Status serve_requests();
  Status show();
  void draw_overlay_model(double now);
  void set_fullscreen(bool fullscreen);
  void update_pointer(double now);
  void count_picture(double now);
  [[nodiscard]] int ui_scale(int window_height, int drawable_height) const;

  const WindowOptions& options_;
  // Destroyed from the last to the first: GL objects before the context, SDL at the very end.
  SdlQuit quit_;
  std::unique_ptr<SDL_Window, WindowDelete> window_;
  std::unique_ptr<void, ContextDelete> context_;
  bool es3_ = true;
  std::unique_ptr<gles::Device> device_;
  std::unique_ptr<gles::Overlay> overlay_;
  std::unique_ptr<WindowSession> session_;

  SdlEvents events_;
  PointerRest pointer_;
  std::vector<Action> actions_;
  gles::OverlayCanvas canvas_;
  OverlayModel model_;
  WindowStatistics statistics_;
  int width_px_ = 0, height_px_ = 0;
  float points_per_unit_ = 1;  // of the overlay, in a unit of SDL's window coordinates
  bool fullscreen_ = false, pointer_shown_ = true, leave_ = false, exposed_ = true;
  bool overlay_shown_ = false;
  double drawn_s_ = -1;  // when the last picture was
  std::string shown_title_;
  std::uint64_t shown_ = 0, counted_ = 0;
  double counted_since_s_ = now_s(), last_picture_s_ = 0;
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
  es3_ = es3;
  return {};
}

Status Window::open() {
  // A window in full screen stays one among others.
  SDL_SetHint(SDL_HINT_VIDEO_X11_NET_WM_BYPASS_COMPOSITOR, "0");
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
  // Late pictures are shown at once where the driver can do that.
  if (SDL_GL_SetSwapInterval(-1) != 0) SDL_GL_SetSwapInterval(1);
  const auto make_device = [this] {
    gles::DeviceOptions device;
    device.get_proc_address = [](const char* name) { return SDL_GL_GetProcAddress(name); };
    if (!es3_) device.profile = gles::Profile::kEs2;
    return gles::Device::create(device);
  };
  RELIT_ASSIGN(device_, make_device());
  RELIT_ASSIGN(overlay_, gles::Overlay::create(*device_));
  statistics_.renderer = device_->is_es3() ? "OpenGL ES 3" : "OpenGL ES 2";
  const std::string& renderer = device_->caps().renderer;
  if (!renderer.empty()) statistics_.renderer += ", " + renderer.substr(0, renderer.find(' '));
  RELIT_ASSIGN(session_, WindowSession::create(options_, make_device));
  SDL_EventState(SDL_DROPFILE, SDL_ENABLE);
  SDL_EventState(SDL_DROPTEXT, SDL_ENABLE);
  SDL_StartTextInput();
  if (options_.fullscreen) set_fullscreen(true);
  return {};
}

Status Window::run() {
  while (!leave_) {
    SDL_Event event;
    while (!leave_ && SDL_PollEvent(&event) != 0) handle(event);
    RELIT_TRY(serve_requests());
    if (leave_) break;
    RELIT_TRY(show());
    if (options_.max_shown != 0 && shown_ >= options_.max_shown) break;
  }
  return {};
}

void Window::handle(const SDL_Event& event) {
  switch (event.type) {
    case SDL_QUIT:
      leave_ = true;
      return;
    case SDL_WINDOWEVENT:
      exposed_ = true;
      if (event.window.event == SDL_WINDOWEVENT_LEAVE) pointer_.left();
      return;
    case SDL_DROPFILE:
    case SDL_DROPTEXT:
      if (event.drop.file != nullptr) session_->drop(event.drop.file);
      SDL_free(event.drop.file);
      return;
    default:
      break;
  }
  actions_.clear();
  if (events_.translate(event, points_per_unit_, actions_)) pointer_.moved(now_s());
  for (const Action& action : actions_) session_->act(action);
  // Panels come and go, and messages.
  exposed_ = exposed_ || !actions_.empty();
}

Status Window::serve_requests() {
  const WindowSession::Requests requests = session_->take_requests();
  if (requests.quit) leave_ = true;
  if (requests.fullscreen) set_fullscreen(!fullscreen_);
  if (requests.escape) {
    if (fullscreen_) {
      set_fullscreen(false);
    } else {
      leave_ = true;
    }
  }
  if (requests.screenshot && width_px_ > 0) {
    auto written = write_screenshot(*device_, width_px_, height_px_, [&](int width, int height) {
      return session_->draw(width, height);
    });
    if (written) {
      session_->say("screenshot: " + *written);
    } else {
      session_->say(written.error().message, true);
    }
    exposed_ = true;
  }
  return {};
}

void Window::set_fullscreen(bool fullscreen) {
  fullscreen_ = fullscreen;
  SDL_SetWindowFullscreen(window_.get(), fullscreen ? SDL_WINDOW_FULLSCREEN_DESKTOP : 0);
  exposed_ = true;
}

void Window::update_pointer(double now) {
  const bool shown = !fullscreen_ || !pointer_.resting(now) || events_.input().dragging();
  if (shown == pointer_shown_) return;
  pointer_shown_ = shown;
  SDL_ShowCursor(shown ? SDL_ENABLE : SDL_DISABLE);
}

// By the display where it says so; else by the size, as on a large screen of many pixels one sits
// farther away or has small pixels.
int Window::ui_scale(int window_height, int drawable_height) const {
  if (options_.ui_scale > 0) return options_.ui_scale;
  const double ratio = static_cast<double>(drawable_height) / std::max(window_height, 1);
  const double by_size = static_cast<double>(drawable_height) / 1080;
  return std::clamp(static_cast<int>(std::lround(std::max(ratio, by_size))), 1,
                    gles::FontAtlas::kMaxScale);
}

Status Window::show() {
  const double now = now_s();
  if (const Status updated = session_->update(now); !updated) {
    // Without GL or a clip nothing can be shown; anything else is told, and what is there stays.
    if (!session_->ready() || updated.error().code == ErrorCode::kEnvironment) return updated;
    session_->say(updated.error().message, true);
  }
  update_pointer(now);
  const bool moving = events_.input().scrubbing() || pointer_.visibility(now) > 0;
  const bool overlay = moving || session_->has_overlay();
  // Where drawing takes the processor it would take all of it.
  const bool due = overlay && now - drawn_s_ >= session_->overlay_period_s();
  const bool draw = exposed_ || session_->changed() || moving || due || overlay != overlay_shown_;
  if (!draw) {
    SDL_WaitEventTimeout(nullptr,
                         static_cast<int>(std::clamp(session_->idle_s(), 0.001, 0.1) * 1e3));
    return {};
  }
  exposed_ = false;
  overlay_shown_ = overlay;
  drawn_s_ = now;
  SDL_GL_GetDrawableSize(window_.get(), &width_px_, &height_px_);
  if (width_px_ < 1 || height_px_ < 1) {
    SDL_WaitEventTimeout(nullptr, 50);
    return {};
  }
  if (session_->ready()) {
    RELIT_TRY(session_->draw(width_px_, height_px_));
  } else {
    device_->gl().ClearColor(0.1f, 0.1f, 0.1f, 1);
    device_->gl().Clear(GL_COLOR_BUFFER_BIT);
    session_->draw_nothing();
  }
  draw_overlay_model(now);
  RELIT_TRY(overlay_->draw(canvas_));
  const double before_swap = now_s();
  SDL_GL_SwapWindow(window_.get());
  statistics_.stages[4] = {"present", 1e3 * (now_s() - before_swap)};
  if (session_->ready()) count_picture(now_s());
  if (session_->title() != shown_title_) {
    shown_title_ = session_->title();
    SDL_SetWindowTitle(window_.get(), (shown_title_ + " – relit").c_str());
  }
  return {};
}

void Window::draw_overlay_model(double now) {
  int window_width = 1, window_height = 1;
  SDL_GetWindowSize(window_.get(), &window_width, &window_height);
  const int scale = ui_scale(window_height, height_px_);
  canvas_.begin(width_px_, height_px_, scale);
  points_per_unit_ = canvas_.height() / static_cast<float>(std::max(window_height, 1));
  const ControlLayout layout = layout_controls(canvas_.width(), canvas_.height());
  model_.controls = events_.input().scrubbing() ? 1 : pointer_.visibility(now);
  session_->fill(model_, statistics_);
  statistics_.width_px = width_px_, statistics_.height_px = height_px_;
  // Hidden controls are not hit.
  const bool there = model_.controls > 0;
  const auto area = [&](const gles::OverlayRect& rect) {
    return there ? ControlArea{rect.x, rect.y, rect.width, rect.height} : ControlArea{};
  };
  events_.input().set_layout(canvas_.height(), area(layout.bar), area(layout.pause));
  draw_overlay(canvas_, model_);
}

void Window::count_picture(double now) {
  ++shown_, ++counted_;
  if (last_picture_s_ > 0)
    statistics_.picture_ms.add(static_cast<float>(1e3 * (now - last_picture_s_)));
  last_picture_s_ = now;
  const WindowStatistics::Memory& ring = statistics_.memory[0];
  if (ring.limit_bytes > 0)
    statistics_.buffer.add(static_cast<float>(static_cast<double>(ring.bytes) /
                                              static_cast<double>(ring.limit_bytes)));
  if (now - counted_since_s_ < 0.5) return;
  statistics_.pictures_per_s = static_cast<double>(counted_) / (now - counted_since_s_);
  counted_ = 0, counted_since_s_ = now;
}

}  // namespace

Result<PlaybackLoss> play_in_window(const WindowOptions& options) {
  Window window(options);
  RELIT_TRY(window.open());
  RELIT_TRY(window.run());
  return window.loss();
}

}  // namespace relit::player
