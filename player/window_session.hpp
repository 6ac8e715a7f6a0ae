// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gles/device.hpp"
#include "player/background.hpp"
#include "player/player.hpp"
#include "player/window.hpp"
#include "player/window_input.hpp"
#include "player/window_overlay.hpp"

namespace relit::player {

/// What is played in a window, and what the user has changed about it; knows no window system.
/// Needs the GL context current for every call, construction and destruction included. One thread.
class WindowSession {
 public:
  using MakeDevice = std::function<Result<std::unique_ptr<gles::Device>>()>;

  /// What only the window can do, since it was asked last.
  struct Requests {
    bool quit = false, fullscreen = false, escape = false, screenshot = false;
  };

  /// Begins to open the source, which update() ends. `options` is borrowed and outlives this
  /// object; `make_device` is called for every file that is opened. Errors: options that make no
  /// sense, kEnvironment where there is no thread to be had.
  static Result<std::unique_ptr<WindowSession>> create(const WindowOptions& options,
                                                       MakeDevice make_device);

  /// Does what the user wants; escape stops what is being opened. What fails is said in a message.
  void act(const Action& action);
  /// Takes a file or address that was dropped: lights by their suffix, anything else to be played.
  /// It is opened on another thread while what is there goes on; where that fails everything stays,
  /// and a message says why.
  void drop(const std::string& path);

  /// Brings playback to `now_s` of a monotonic clock, and what has been opened into it. Errors:
  /// those of GL, and the source's once each; while it is not ready(), those of opening it.
  Status update(double now_s);
  /// Whether there is something to play: the first source has been opened.
  [[nodiscard]] bool ready() const { return player_ != nullptr; }
  /// Something is being opened.
  [[nodiscard]] bool opening() const { return opening_ || lighting_; }
  /// There is something to draw that the last draw() did not show.
  [[nodiscard]] bool changed() const { return changed_; }
  /// Draws the picture, without overlay, into the framebuffer that is bound. Requires ready().
  Status draw(int width, int height);
  /// In its place before ready(): the background is all that there is, until something changes.
  void draw_nothing() { changed_ = false; }
  /// Shows a message for a while.
  void say(std::string text, bool is_error = false);

  [[nodiscard]] Requests take_requests() { return std::exchange(requests_, {}); }
  /// Fills in everything. The controls are shown as far as the model says already, and for a while
  /// after a seek.
  void fill(OverlayModel& model, WindowStatistics& statistics) const;
  /// Whether fill() gives something that changes from picture to picture.
  [[nodiscard]] bool has_overlay() const;
  /// How long nothing will change by itself, seconds.
  [[nodiscard]] double idle_s() const;
  /// How often what is written over the picture is drawn anew while nothing else changes.
  [[nodiscard]] double overlay_period_s() const;

  [[nodiscard]] const std::string& title() const { return title_; }
  [[nodiscard]] PlaybackLoss loss() const {
    return player_ ? player_->stats().loss : PlaybackLoss();
  }

  static constexpr double kControls_s = 1.2;  ///< after a seek

 private:
  WindowSession(const WindowOptions& options, MakeDevice make_device)
      : options_(options), make_device_(std::move(make_device)) {}

  // A source that is being opened.
  struct Opening {
    std::string title;
    bool as_asked = false;  // with the clips, start and loop of the options
    double since_s = 0;
    std::shared_ptr<std::string> why = std::make_shared<std::string>();
    std::shared_ptr<Interrupt> interrupt = std::make_shared<Interrupt>();
    std::shared_ptr<std::atomic<std::uint64_t>> read_bytes =
        std::make_shared<std::atomic<std::uint64_t>>(0);
    std::optional<Background<std::unique_ptr<Player>>> player;
    ~Opening() { interrupt->raise(); }  // before the thread is waited for
  };
  Status begin_opening(const std::string& source, bool as_asked);
  Status begin_lighting(const std::string& path);
  [[nodiscard]] PlayerOptions player_options(const std::string& source,
                                             const Opening& opening) const;
  Status take_opened();
  Status use(Opening& opening, std::unique_ptr<Player> player);
  void take_light();
  void cancel_opening();
  Status start(Player& player, bool as_asked) const;
  [[nodiscard]] std::string opening_text() const;

  Status change(const Action& action);
  Status change_light(int way);
  Status change_clip(int way);
  Status change_path(int way);
  Status change_quality(int way);
  Status change_planes(const Action& action);
  Status change_speed(double speed);
  void change_exposure(double stops);
  void show_controls() { controls_until_s_ = now_s_ + kControls_s; }
  void move_camera(const Action& action);
  [[nodiscard]] const container::ClipRecord& clip() const;
  [[nodiscard]] std::string light_text() const;
  [[nodiscard]] int planes_of_clip() const;
  [[nodiscard]] std::string planes_text() const;
  Status change_player(const Action& action);
  void fill_statistics(const PlayerStats& stats, WindowStatistics& statistics) const;

  const WindowOptions& options_;
  MakeDevice make_device_;
  std::unique_ptr<Player> player_;
  std::string title_;
  std::shared_ptr<std::string> why_;  ///< the composite path; what the player's log tells
  std::vector<LoadedLight> lights_;
  std::size_t light_ = 0;
  double light_turn_rad_ = 0;
  Look look_;
  OrbitCamera camera_;
  double exposure_stops_ = 0;  ///< beyond the look's
  CompositePath path_ = CompositePath::kAuto;
  std::optional<double> quality_;
  int planes_ = -1;

  std::unique_ptr<Opening> opening_;
  std::optional<Background<LoadedLight>> lighting_;
  std::string lighting_name_;
  mutable std::string opening_text_;  // lent to the overlay; empty where it does not show

  Requests requests_;
  bool keys_ = false, statistics_ = false, changed_ = true;
  ViewSize size_;
  double now_s_ = 0;
  std::optional<double> waiting_since_s_;
  std::string message_;
  double message_until_s_ = 0, controls_until_s_ = 0;
  bool message_is_error_ = false;
};

}  // namespace relit::player
