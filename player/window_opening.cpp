// SPDX-License-Identifier: MIT
// How a session opens sources and lights while it goes on.
#include <cstdio>
#include <filesystem>

#include "player/video_tracks.hpp"
#include "player/window_session.hpp"

namespace relit::player {
namespace {

std::string name_of(const std::string& source) {
  if (source == "-") return source_name(source);
  std::string name = source.substr(0, source.find_first_of("?#"));
  name = std::filesystem::path(name).filename().string();
  return name.empty() ? source : name;
}

// Counts what is read, for whoever waits.
class CountedSource final : public container::ByteSource {
 public:
  CountedSource(std::unique_ptr<container::ByteSource> source,
                std::shared_ptr<std::atomic<std::uint64_t>> bytes)
      : source_(std::move(source)), bytes_(std::move(bytes)) {}
  Result<std::size_t> read(std::span<std::uint8_t> out) override {
    auto got = source_->read(out);
    if (got) bytes_->fetch_add(*got, std::memory_order_relaxed);
    return got;
  }
  [[nodiscard]] std::optional<std::uint64_t> size() const override { return source_->size(); }
  [[nodiscard]] bool seekable() const override { return source_->seekable(); }
  Status seek(std::uint64_t offset_bytes) override { return source_->seek(offset_bytes); }
  void expect(std::uint64_t begin_bytes, std::uint64_t end_bytes) override {
    source_->expect(begin_bytes, end_bytes);
  }

 private:
  std::unique_ptr<container::ByteSource> source_;
  std::shared_ptr<std::atomic<std::uint64_t>> bytes_;
};

}  // namespace

PlayerOptions WindowSession::player_options(const std::string& source,
                                            const Opening& opening) const {
  PlayerOptions player = options_.player;
  player.name = source_name(source);
  player.clip = opening.as_asked && options_.clips.size() == 1 ? options_.clips.front() : "";
  player.path = path_;
  player.governor.quality = quality_;
  player.interrupt = opening.interrupt;
  player.log = [why = opening.why](LogLevel level, const std::string& sentence) {
    constexpr std::string_view kPath = "composite: ";
    if (sentence.compare(0, kPath.size(), kPath) == 0) {
      *why = sentence.substr(kPath.size());
    } else {
      std::fprintf(stderr, "relit: %s%s\n", level == LogLevel::kWarning ? "warning: " : "",
                   sentence.c_str());
    }
  };
  return player;
}

Status WindowSession::begin_opening(const std::string& source, bool as_asked) {
  cancel_opening();
  auto opening = std::make_unique<Opening>();
  opening->title = name_of(source);
  opening->as_asked = as_asked;
  opening->since_s = now_s_;
  SourceOptions reading = options_.reading;
  reading.sparing = options_.player.layers >= 0;
  reading.interrupt = Interrupt::poll(opening->interrupt);
  RELIT_ASSIGN(auto begun, Background<std::unique_ptr<Player>>::start(
                               [source, reading, player = player_options(source, *opening),
                                bytes = opening->read_bytes]() -> Result<std::unique_ptr<Player>> {
                                 RELIT_ASSIGN(auto opened, open_source(source, reading));
                                 return Player::open(
                                     std::make_unique<CountedSource>(std::move(opened), bytes),
                                     player);
                               }));
  opening->player.emplace(std::move(begun));
  opening_ = std::move(opening);
  return {};
}

Status WindowSession::begin_lighting(const std::string& path) {
  RELIT_ASSIGN(auto begun, Background<LoadedLight>::start(
                               [path, light = options_.light] { return load_light(path, light); }));
  lighting_.reset();
  lighting_.emplace(std::move(begun));
  lighting_name_ = name_of(path);
  return {};
}

void WindowSession::drop(const std::string& path) {
  const std::string end = std::filesystem::path(path).extension().string();
  const bool is_light = end == ".hdr" || end == ".exr" || end == ".json";
  const Status begun = is_light ? begin_lighting(path) : begin_opening(path, false);
  if (!begun) say(begun.error().message, true);
}

void WindowSession::cancel_opening() {
  opening_.reset();
  lighting_.reset();
}

// What has been opened since is played; where that fails, what there was goes on.
Status WindowSession::take_opened() {
  take_light();
  if (!opening_) return {};
  auto opened = opening_->player->take();
  if (!opened) return {};
  const std::unique_ptr<Opening> opening = std::move(opening_);
  const Status used =
      *opened ? use(*opening, std::move(**opened)) : Status(Unexpected{opened->error()});
  if (!used && ready()) say(used.error().message, true);
  return ready() ? Status() : used;
}

Status WindowSession::use(Opening& opening, std::unique_ptr<Player> player) {
  RELIT_ASSIGN(auto device, make_device_());
  RELIT_TRY(player->attach(std::move(device)));
  RELIT_TRY(start(*player, opening.as_asked));
  player->set_planes(planes_);
  if (!opening.as_asked) say(opening.title);
  player_ = std::move(player);
  title_ = opening.title;
  why_ = opening.why;
  changed_ = true;
  return {};
}

Status WindowSession::start(Player& player, bool as_asked) const {
  if (!lights_.empty()) RELIT_TRY(player.set_light(lights_[light_]));
  RELIT_TRY(player.turn_light(light_turn_rad_));
  player.set_position(options_.position);
  if (!as_asked) return {};
  if (options_.clips.size() > 1) {
    std::vector<SequenceItem> items;
    for (const std::string& wanted : options_.clips) {
      SequenceItem item;
      const auto& file = player.contents();
      RELIT_ASSIGN(const container::ClipRecord* clip,
                   find_clip(file, wanted, source_name(options_.source)));
      item.clip = static_cast<std::size_t>(clip - file.clips.data());
      item.cross_fade_s = options_.cross_fade_s;
      items.push_back(item);
    }
    RELIT_TRY(player.play_sequence(items, true));
  }
  if (options_.loop != LoopMode::kAsGiven) player.set_loop(options_.loop);
  if (options_.speed != 1) RELIT_TRY(player.set_speed(options_.speed));
  if (options_.start_s != 0) RELIT_TRY(player.seek(options_.start_s));
  return {};
}

void WindowSession::take_light() {
  if (!lighting_) return;
  auto light = lighting_->take();
  if (!light) return;
  lighting_.reset();
  if (!*light) return say(light->error().message, true);
  if (ready()) {
    if (const Status set = player_->set_light(**light); !set) return say(set.error().message, true);
  }
  lights_.push_back(std::move(**light));
  light_ = lights_.size() - 1;
  say("light: " + light_text());
}

std::string WindowSession::opening_text() const {
  if (!opening_) return "opening " + lighting_name_ + "…  (escape cancels)";
  std::array<char, 32> room{};
  const std::uint64_t bytes = opening_->read_bytes->load(std::memory_order_relaxed);
  return "opening " + opening_->title + "…  " + std::string(format_bytes(bytes, room)) +
         "  (escape cancels)";
}

}  // namespace relit::player
