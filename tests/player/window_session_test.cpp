// SPDX-License-Identifier: MIT
#include "player/window_session.hpp"

#include <sys/stat.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include "gles/offscreen.hpp"
#include "gles/picture.hpp"
#include "tests/player/files.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::player;
using namespace relit::player::test;

namespace {

// A session in a context off the screen, with a clock that the test moves.
class Session {
 public:
  explicit Session(const std::function<void(WindowOptions&)>& adapt = {}) {
    auto created = gles::OffscreenContext::create(gles::OffscreenKind::kEglEs3);
    if (!created) FAIL(created.error().message);
    context_ = std::move(*created);
    options.source = shipped_clip().string();
    options.player.threads = 1;
    auto light = load_light(shipped_light().string());
    REQUIRE(light);
    options.lights.push_back(std::move(*light));
    if (adapt) adapt(options);
    opened = open();
  }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  Status open() {
    auto session = WindowSession::create(options, [this] { return make_device(); });
    if (!session) return Unexpected{session.error()};
    self = std::move(*session);
    return await();
  }
  // Until nothing is being opened any more.
  Status await() {
    for (int i = 0; i < 3000; ++i) {
      RELIT_TRY(self->update(now_s));
      if (!self->opening()) return {};
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return fail(ErrorCode::kIo, "it does not open");
  }

  [[nodiscard]] Result<std::unique_ptr<gles::Device>> make_device() const {
    return gles::Device::create({context_->get_proc_address(), {}, {}});
  }

  // Updates, the clock standing, until what is due is here and shown.
  void settle() {
    for (int i = 0; i < 3000; ++i) {
      REQUIRE(self->update(now_s));
      if (self->idle_s() > 0.01 && i > 2) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    FAIL("the frame does not come");
  }
  OverlayModel model() {
    OverlayModel filled;
    self->fill(filled, statistics);
    return filled;
  }
  std::string message() { return std::string(model().message); }
  std::string act(ActionKind kind, double amount = 0) {
    self->act({kind, amount});
    return message();
  }

  WindowOptions options;
  Status opened;
  WindowStatistics statistics;
  double now_s = 100;

 private:
  std::unique_ptr<gles::OffscreenContext> context_;

 public:
  std::unique_ptr<WindowSession> self;  ///< goes before the context
};

}  // namespace

TEST_CASE("a session says what each action has changed") {
  Session session([](WindowOptions& options) { options.lights.push_back(options.lights[0]); });
  REQUIRE(session.opened);
  session.settle();
  CHECK(session.act(ActionKind::kPause) == "⏸ paused");
  CHECK(session.model().paused);
  CHECK(session.act(ActionKind::kPause) == "▶ playing");
  CHECK(session.act(ActionKind::kExposureBy, 0.25) == "exposure +0.25");
  CHECK(session.act(ActionKind::kExposureBy, -0.5) == "exposure -0.25");
  CHECK(session.act(ActionKind::kSpeedBy, 1.1) == "speed 1.10×");
  CHECK(session.act(ActionKind::kSpeedBy, 1 / 1.1) == "speed 1.00×");
  CHECK(session.act(ActionKind::kSpeedBy, 1e-9) == "speed 0.01×");
  CHECK(session.act(ActionKind::kSpeedBy, 1e9) == "speed 100.00×");
  CHECK(session.act(ActionKind::kSpeedReset) == "speed 1.00×");
  CHECK(session.act(ActionKind::kLight, 1) == "light: studio_soft (2 of 2)");
  CHECK(session.act(ActionKind::kLight, 1) == "light: studio_soft (1 of 2)");
  CHECK(session.act(ActionKind::kLight, -1) == "light: studio_soft (2 of 2)");
  CHECK(session.act(ActionKind::kClip, 1) == "clip: walk, the only one");
  CHECK(session.act(ActionKind::kPlanesBy, -1) == "26 of 27 planes");
  CHECK(session.act(ActionKind::kPlanesTo, 1) == "1 of 27 planes");
  CHECK(session.act(ActionKind::kPlanesBy, -1) == "1 of 27 planes");
  CHECK(session.act(ActionKind::kPlanesTo, 9) == "9 of 27 planes");
  CHECK(session.act(ActionKind::kPlanesBy, 1) == "10 of 27 planes");
  session.settle();
  session.act(ActionKind::kStatisticsPanel);
  session.model();
  // Of those, the exposure leaves out what it cannot show.
  CHECK(session.statistics.planes.find(" of 27, 10 asked for") != std::string::npos);
  session.act(ActionKind::kStatisticsPanel);
  CHECK(session.act(ActionKind::kPlanesTo, 0) == "27 of 27 planes");
  for (const char* path : {"path: cpu", "path: texture", "path: fused", "path: auto"})
    CHECK(session.act(ActionKind::kPath, 1) == path);
  CHECK(session.act(ActionKind::kPath, -1) == "path: fused");
  for (const char* quality : {"quality: 1.00", "quality: 0.75", "quality: 0.50", "quality: 0.25",
                              "quality: 0.00", "quality: auto"})
    CHECK(session.act(ActionKind::kQualityBy, 1) == quality);
  CHECK(session.act(ActionKind::kQualityBy, -1) == "quality: 0.00");
  CHECK(session.act(ActionKind::kResetCamera) == "camera reset");
  // Messages go by themselves.
  session.now_s += 5;
  session.settle();
  CHECK(session.model().message_visibility == 0);
}

TEST_CASE("a session seeks, steps and shows the bar meanwhile") {
  Session session;
  REQUIRE(session.opened);
  session.settle();
  session.act(ActionKind::kPause);
  session.act(ActionKind::kSeekTo, 0.5);
  session.settle();
  CHECK(session.model().time_s == Approx(1.2).margin(1e-4));
  CHECK(session.model().frame == 60);
  CHECK(session.model().controls > 0);
  session.act(ActionKind::kStep, 1);
  session.settle();
  CHECK(session.model().frame == 61);
  session.act(ActionKind::kSeekBy, -1);
  session.settle();
  CHECK(session.model().time_s == Approx(1.22 - 0.24).margin(1e-4));
  session.act(ActionKind::kSeekTo, 1);
  session.settle();
  CHECK(session.model().frame == 119);
  session.now_s += 5;
  session.settle();
  CHECK(session.model().controls == 0);
}

TEST_CASE("a session plays what is dropped, and keeps what it has where that fails") {
  const Folder folder;
  Session session;
  REQUIRE(session.opened);
  session.settle();
  const auto write = [&](const char* name, const std::string& bytes) {
    std::ofstream(folder.file(name), std::ios::binary) << bytes;
    return folder.file(name);
  };
  for (const std::string& bad :
       {write("none.relit", "this is no relit file"), write("none.hdr", "nor is this a picture"),
        write("none.json", "{"), folder.file("missing.relit"), folder.file("missing.exr"),
        write("letter.txt", "dear reader")}) {
    session.self->drop(bad);
    REQUIRE(session.await());
    INFO(bad << ": " << session.message());
    CHECK(session.model().message_is_error);
    CHECK(session.message().find(bad) != std::string::npos);
    CHECK(session.self->title() == "mannequin.relit");
    session.settle();
  }
  session.self->drop(write("sky.json", R"({"sh": [[1, 1, 1]]})"));
  REQUIRE(session.await());
  CHECK(session.message() == "light: sky (2 of 2)");
  std::filesystem::copy_file(shipped_clip(), folder.file("other.relit"));
  session.act(ActionKind::kStatisticsPanel);
  session.self->drop(folder.file("other.relit"));
  REQUIRE(session.await());
  CHECK(session.self->title() == "other.relit");
  session.settle();
  // Under the light that was chosen.
  session.model();
  CHECK(session.statistics.light == "sky (2 of 2)");
}

TEST_CASE("what is being opened holds nothing up, says so, and can be cancelled") {
  const Folder folder;
  std::signal(SIGPIPE, SIG_IGN);
  const auto make_pipe = [&](const char* name) {
    REQUIRE(::mkfifo(folder.file(name).c_str(), 0600) == 0);
    return folder.file(name);
  };
  // Somebody who writes when the test says so: until then opening waits, in the system.
  const auto feed = [](const std::string& pipe, std::size_t bytes) {
    auto file = read_bytes(shipped_clip());
    file.resize(std::min(bytes, file.size()));
    std::ofstream(pipe, std::ios::binary)
        .write(reinterpret_cast<const char*>(file.data()), static_cast<std::streamsize>(bytes));
  };
  Session session;
  REQUIRE(session.opened);
  session.settle();
  const std::string stalled = make_pipe("pipe.relit");
  session.self->drop(stalled);
  CHECK(session.self->opening());
  const double started_s = session.model().time_s;
  for (int i = 0; i < 20; ++i) {
    session.now_s += 0.02;
    REQUIRE(session.self->update(session.now_s));
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  // Playback goes on, keys are heard.
  CHECK(session.model().time_s != started_s);
  CHECK(session.message().rfind("opening pipe.relit…", 0) == 0);
  CHECK(session.self->has_overlay());
  CHECK(session.act(ActionKind::kExposureBy, 0.25) == "exposure +0.25");
  session.act(ActionKind::kEscape);
  CHECK_FALSE(session.self->opening());
  CHECK_FALSE(session.self->take_requests().escape);
  CHECK(session.message() == "opening cancelled");
  // What breaks off is told, and what was there stays.
  const std::string broken = make_pipe("broken.relit");
  session.self->drop(broken);
  feed(broken, 1000);
  REQUIRE(session.await());
  CHECK(session.model().message_is_error);
  CHECK(session.self->title() == "mannequin.relit");
  const std::string whole = make_pipe("whole.relit");
  session.self->drop(whole);
  std::thread feeder([&] { feed(whole, std::filesystem::file_size(shipped_clip())); });
  REQUIRE(session.await());
  CHECK(session.self->title() == "whole.relit");
  session.settle();
  session.self.reset();  // closes the pipe, whatever of it has not been read
  feeder.join();
}

TEST_CASE("before the first source is open only what needs none is done") {
  const Folder folder;
  const std::string pipe = folder.file("pipe.relit");
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  Session session;
  session.options.source = pipe;
  auto made = WindowSession::create(session.options, [&session] { return session.make_device(); });
  REQUIRE(made);
  session.self = std::move(*made);
  REQUIRE(session.self->update(session.now_s));
  CHECK_FALSE(session.self->ready());
  for (const ActionKind kind : {ActionKind::kPause, ActionKind::kSeekTo, ActionKind::kPlanesTo,
                                ActionKind::kLight, ActionKind::kZoom, ActionKind::kScreenshot})
    session.self->act({kind, 1});
  CHECK_FALSE(session.self->take_requests().screenshot);
  CHECK(session.message().rfind("opening pipe.relit…", 0) == 0);
  session.self->act({ActionKind::kKeysPanel});
  CHECK(session.model().keys);
  session.self->act({ActionKind::kEscape});
  CHECK_FALSE(session.self->take_requests().escape);
  session.self->act({ActionKind::kEscape});
  CHECK(session.self->take_requests().escape);
  CHECK_FALSE(session.self->loss().any());
  session.self.reset();
}

TEST_CASE("a session draws, and asks the window for what is the window's") {
  Session session;
  REQUIRE(session.opened);
  session.settle();
  const auto device = session.make_device();
  REQUIRE(device);
  const auto target = gles::Framebuffer::create(**device, {32, 24, 1});
  REQUIRE(target);
  target->bind();
  CHECK(session.self->changed());
  CHECK(session.self->draw(32, 24));
  CHECK_FALSE(session.self->changed());
  for (const ActionKind kind : {ActionKind::kOrbit, ActionKind::kPan, ActionKind::kZoom}) {
    session.self->act({kind, 0.5, 0.5});
    CHECK(session.self->changed());
    CHECK(session.self->draw(32, 24));
  }
  session.self->act({ActionKind::kQuit});
  session.self->act({ActionKind::kFullscreen});
  session.self->act({ActionKind::kScreenshot});
  WindowSession::Requests requests = session.self->take_requests();
  CHECK((requests.quit && requests.fullscreen && requests.screenshot && !requests.escape));
  // Escape closes panels first.
  session.self->act({ActionKind::kKeysPanel});
  CHECK(session.model().keys);
  session.self->act({ActionKind::kEscape});
  CHECK_FALSE(session.model().keys);
  CHECK_FALSE(session.self->take_requests().escape);
  session.self->act({ActionKind::kEscape});
  CHECK(session.self->take_requests().escape);
}

TEST_CASE("a session plays sequences, and refuses clips, looks and files that are not there") {
  Session sequence([](WindowOptions& options) {
    options.clips = {"walk", "0"};
    options.cross_fade_s = 0.4;
  });
  REQUIRE(sequence.opened);
  // Two of 2.4 s, each blending into the other, as the sequence goes round.
  CHECK(sequence.model().duration_s == Approx(4.0));
  const Session no_clip([](WindowOptions& options) { options.clips = {"walk", "swim"}; });
  REQUIRE_FALSE(no_clip.opened);
  CHECK(no_clip.opened.error().code == ErrorCode::kNotFound);
  CHECK(no_clip.opened.error().message.find("walk") != std::string::npos);
  for (const auto& [what, adapt] :
       std::vector<std::pair<const char*, std::function<void(WindowOptions&)>>>{
           {"--exposure", [](WindowOptions& o) { o.look.exposure = "bright"; }},
           {"--tone-map", [](WindowOptions& o) { o.look.tone_map = "sepia"; }},
           {"--background", [](WindowOptions& o) { o.look.background = "#12345"; }},
           {"--background", [](WindowOptions& o) { o.look.background = "#12345g"; }},
           {"nowhere", [](WindowOptions& o) { o.source = "/nowhere/at.relit"; }}}) {
    const Session refused(adapt);
    REQUIRE_FALSE(refused.opened);
    CHECK(refused.opened.error().message.find(what) != std::string::npos);
  }
}
