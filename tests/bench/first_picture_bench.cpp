// SPDX-License-Identifier: MIT
// From relit_open() with a context current to the first picture, stage by stage: medians of many
// openings of a local file, the driver's shader cache warm after the first.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
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

struct Stages {
  double open = 0, attach = 0, wait = 0, draw = 0;
  [[nodiscard]] double total() const { return open + attach + wait + draw; }
};

double lap(Clock::time_point& from) {
  const Clock::time_point now = Clock::now();
  const double ms = std::chrono::duration<double, std::milli>(now - from).count();
  from = now;
  return ms;
}

void require(relit_result result, relit_player* player, const char* what) {
  if (result == RELIT_OK) return;
  std::fprintf(stderr, "%s: %s\n", what, relit_last_error(player));
  std::exit(1);
}

Stages show_first(const char* path, const GetProcAddress& find, const relit_view& view,
                  const relit::gles::Functions& gl) {
  Stages stages;
  relit_player* player = nullptr;
  Clock::time_point from = Clock::now();
  require(relit_open(path, nullptr, &player), player, "open");
  stages.open = lap(from);
  relit_gl_options options;
  relit_gl_options_default(&options, sizeof options);
  options.user = const_cast<GetProcAddress*>(&find);
  options.get_proc_address = [](void* user, const char* name) {
    return (*static_cast<GetProcAddress*>(user))(name);
  };
  require(relit_gl_attach(player, &options), player, "attach");
  stages.attach = lap(from);
  relit_moment moment{};
  moment.struct_size = sizeof moment;
  // As a host's loop does: whatever is here first is drawn.
  for (std::int64_t now_ns = 0; moment.ready == 0; ++now_ns) {
    require(relit_update(player, now_ns, &moment), player, "update");
    if (moment.ready == 0) std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  stages.wait = lap(from);
  require(relit_draw(player, &view), player, "draw");
  gl.Finish();
  stages.draw = lap(from);
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
  std::vector<double> open, attach, wait, draw, total;
  for (int i = 0; i <= rounds; ++i) {
    const Stages stages = show_first(path, find, view, (*device)->gl());
    if (i == 0) continue;  // fills the shader cache
    open.push_back(stages.open), attach.push_back(stages.attach), wait.push_back(stages.wait);
    draw.push_back(stages.draw), total.push_back(stages.total());
  }
  std::printf("first picture, median of %d openings of %s\n", rounds, path);
  std::printf("  relit_open       %7.2f ms  statics, meshes, decoders opened, fetching begun\n",
              median(open));
  std::printf("  relit_gl_attach  %7.2f ms  albedo decoded, meshes and images uploaded\n",
              median(attach));
  std::printf("  first frame here %7.2f ms  after that; then posed and composited\n", median(wait));
  std::printf("  relit_draw       %7.2f ms  shaders, drawing, glFinish\n", median(draw));
  std::printf("  in all           %7.2f ms\n", median(total));
  return 0;
}
