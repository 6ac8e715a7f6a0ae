// SPDX-License-Identifier: MIT
// From relit_open() with a context current to the first picture, stage by stage: medians and
// quartiles of many openings of a local file, the driver's shader cache warm after the first.
// Beside the time on the clock, the processor time of the calling thread and of the whole process,
// which other programs on the machine disturb less.
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

double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  const auto last = static_cast<double>(values.size() - 1);
  return values[static_cast<std::size_t>(share * last + 0.5)];
}

constexpr std::size_t kStages = 4;
constexpr const char* kNames[kStages] = {"relit_open: statics, meshes, decoders, fetching begun",
                                         "relit_gl_attach: albedo decoded, meshes and images up",
                                         "relit_update: the first frame here, posed, composited",
                                         "relit_draw: shaders, drawing, glFinish"};

double processor_ms(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

struct Stages {
  std::array<double, kStages> wall{}, thread{}, process{};
};

// Ends a stage.
class Watch {
 public:
  void lap(Stages& stages, std::size_t stage) {
    const Clock::time_point now = Clock::now();
    const double thread = processor_ms(CLOCK_THREAD_CPUTIME_ID);
    const double process = processor_ms(CLOCK_PROCESS_CPUTIME_ID);
    stages.wall[stage] = std::chrono::duration<double, std::milli>(now - wall_).count();
    stages.thread[stage] = thread - thread_;
    stages.process[stage] = process - process_;
    wall_ = now, thread_ = thread, process_ = process;
  }

 private:
  Clock::time_point wall_ = Clock::now();
  double thread_ = processor_ms(CLOCK_THREAD_CPUTIME_ID);
  double process_ = processor_ms(CLOCK_PROCESS_CPUTIME_ID);
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
  std::array<std::vector<double>, kStages + 1> wall, thread, process;
  for (int i = 0; i <= rounds; ++i) {
    const Stages stages = show_first(path, find, view, (*device)->gl());
    if (i == 0) continue;  // fills the shader cache
    const auto add = [](auto& lists, const std::array<double, kStages>& values) {
      for (std::size_t s = 0; s < kStages; ++s) lists[s].push_back(values[s]);
      lists[kStages].push_back(std::accumulate(values.begin(), values.end(), 0.0));
    };
    add(wall, stages.wall);
    add(thread, stages.thread);
    add(process, stages.process);
  }
  double load = 0;
  (void)getloadavg(&load, 1);
  std::printf("first picture of %s: median (quartiles) of %d openings, load %.1f\n", path, rounds,
              load);
  std::printf("%25s  %8s %8s\n", "ms", "thread", "process");
  for (std::size_t s = 0; s <= kStages; ++s) {
    std::printf("  %7.2f (%6.2f, %6.2f)  %8.2f %8.2f  %s\n", quantile(wall[s], 0.5),
                quantile(wall[s], 0.25), quantile(wall[s], 0.75), quantile(thread[s], 0.5),
                quantile(process[s], 0.5), s < kStages ? kNames[s] : "in all");
  }
  return 0;
}
