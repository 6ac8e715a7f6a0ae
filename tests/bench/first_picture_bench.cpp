// SPDX-License-Identifier: MIT
// From relit_open() with a context current to the first picture, stage by stage: medians of many
// openings of a local file, the driver's shader cache warm after the first.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <numeric>
#include <thread>
#include <vector>

#include "gles/offscreen.hpp"
#include "gles/picture.hpp"
#include "player/relit.h"

namespace {

using relit::gles::GetProcAddress;
using Clock = std::chrono::steady_clock;

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

constexpr std::size_t kStages = 4;
constexpr const char* kNames[kStages] = {"relit_open: statics, meshes, decoders, fetching begun",
                                         "relit_gl_attach: albedo decoded, meshes and images up",
                                         "relit_update: the first frame here, posed, composited",
                                         "relit_draw: shaders, drawing, glFinish"};

double thread_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

struct Stages {
  std::array<double, kStages> wall{}, thread{};
};

// Ends a stage.
class Watch {
 public:
  void lap(Stages& stages, std::size_t stage) {
    const Clock::time_point now = Clock::now();
    const double thread = thread_ms();
    stages.wall[stage] = std::chrono::duration<double, std::milli>(now - wall_).count();
    stages.thread[stage] = thread - thread_;
    wall_ = now, thread_ = thread;
  }

 private:
  Clock::time_point wall_ = Clock::now();
  double thread_ = thread_ms();
};

void require(relit_result result, relit_player* player, const char* what) {
  if (result == RELIT_OK) return;
  std::fprintf(stderr, "%s: %s\n", what, relit_last_error(player));
  std::exit(1);
}

Stages show_first(const char* path, const GetProcAddress& find, const relit_view& view,
                  const relit::gles::Functions& gl) {
  Stages stages;
  relit_player* player = nullptr;
  Watch watch;
  require(relit_open(path, nullptr, &player), player, "open");
  watch.lap(stages, 0);
  relit_gl_options options;
  relit_gl_options_default(&options, sizeof options);
  options.user = const_cast<GetProcAddress*>(&find);
  options.get_proc_address = [](void* user, const char* name) {
    return (*static_cast<GetProcAddress*>(user))(name);
  };
  require(relit_gl_attach(player, &options), player, "attach");
  watch.lap(stages, 1);
  relit_moment moment{};
  moment.struct_size = sizeof moment;
  // As a host's loop does: whatever is here first is drawn.
  for (std::int64_t now_ns = 0; moment.ready == 0; ++now_ns) {
    require(relit_update(player, now_ns, &moment), player, "update");
    if (moment.ready == 0) std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  watch.lap(stages, 2);
  require(relit_draw(player, &view), player, "draw");
  gl.Finish();
  watch.lap(stages, 3);
  relit_close(player);
  return stages;
}

}  // namespace

int main(int argc, char** argv) {
  const char* path = argc > 1 ? argv[1] : "media/mannequin.relit";
  const int rounds = argc > 2 ? std::atoi(argv[2]) : 41;
  auto context = relit::gles::OffscreenContext::create(relit::gles::OffscreenKind::kEglEs3);
  if (!context) {
    std::fprintf(stderr, "%s\n", context.error().message.c_str());
    return 2;
  }
  const GetProcAddress find = (*context)->get_proc_address();
  auto device = relit::gles::Device::create({find, std::nullopt, {}});
  auto framebuffer = relit::gles::Framebuffer::create(**device, {512, 512, 1});
  framebuffer->bind();
  relit_view view;
  relit_view_default(&view, sizeof view);
  view.width = view.height = 512;
  view.background = RELIT_BACKGROUND_TRANSPARENT;
  std::array<std::vector<double>, kStages + 1> wall, thread;
  for (int i = 0; i <= rounds; ++i) {
    const Stages stages = show_first(path, find, view, (*device)->gl());
    if (i == 0) continue;  // fills the shader cache
    for (std::size_t s = 0; s < kStages; ++s) {
      wall[s].push_back(stages.wall[s]);
      thread[s].push_back(stages.thread[s]);
    }
    wall[kStages].push_back(std::accumulate(stages.wall.begin(), stages.wall.end(), 0.0));
    thread[kStages].push_back(std::accumulate(stages.thread.begin(), stages.thread.end(), 0.0));
  }
  std::printf("first picture, median of %d openings of %s\n", rounds, path);
  for (std::size_t s = 0; s <= kStages; ++s)
    std::printf("  %7.2f ms, %7.2f ms of this thread's  %s\n", median(wall[s]), median(thread[s]),
                s < kStages ? kNames[s] : "in all");
  return 0;
}
