// SPDX-License-Identifier: MIT
// The GPU composite in texture space against its floor: the same upload, and a shader that does
// nothing but the same fetches. In turn, in one run, waiting for the GPU each time.
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "gles/compositor.hpp"
#include "gles/offscreen.hpp"
#include "gles/shaders.hpp"

namespace relit::gles {
namespace {

struct Content {
  const char* name;
  int side;
  int tiles;  ///< RGB groups
  int bit_depth;
  int exponent_shift;  ///< -1: none
  bool one_channel = true;
  bool predicts = false;  ///< by the first plane
};

/// Planes as the components of one picture, tiles side by side, as a decoder leaves them.
struct Scene {
  std::vector<std::uint8_t> components[3], exponents;
  std::vector<std::uint16_t> normals;
  std::vector<PlaneView> planes;
  std::vector<Rgb> weights;
  FoldedLight light;
  PlaneSetDescription description;

  explicit Scene(const Content& c) {
    std::mt19937 random(1);
    const int columns = c.tiles > 4 ? 4 : c.tiles, rows = (c.tiles + columns - 1) / columns;
    const int bytes = c.bit_depth > 8 ? 2 : 1, stride = columns * c.side * bytes;
    for (auto& component : components) {
      component.resize(static_cast<std::size_t>(stride) * static_cast<std::size_t>(rows * c.side));
      for (std::size_t i = 0; i < component.size(); ++i)
        component[i] =
            static_cast<std::uint8_t>(bytes == 2 && i % 2 == 1 ? random() % 4 : random());
    }
    const int s = std::max(c.exponent_shift, 0), tile = c.side >> s;
    exponents.resize(static_cast<std::size_t>(columns * tile) *
                     static_cast<std::size_t>(rows * tile));
    for (auto& e : exponents) e = static_cast<std::uint8_t>(125 + random() % 10);
    description.width = description.height = c.side;
    for (int k = 0; k < 3 * c.tiles; ++k) {
      const int x = k / 3 % columns, y = k / 3 / columns, component = k % 3;
      PlaneView view;
      view.mantissa = {components[component].data() + y * c.side * stride + x * c.side * bytes,
                       stride, c.side, c.side, bytes};
      view.mantissa_zero = 1 << (c.bit_depth - 1);
      view.exponent_zero = c.bit_depth > 8 ? 137 : 135;
      view.scale = 1.0f / static_cast<float>(view.mantissa_zero);
      PlaneDescription plane;
      plane.bit_depth = c.bit_depth;
      plane.channels = c.one_channel ? 1u << component : 7u;
      plane.mantissa = {component, x * c.side, y * c.side};
      if (c.exponent_shift >= 0) {
        view.exponent = {exponents.data() + y * tile * columns * tile + x * tile, columns * tile,
                         tile, tile, 1};
        view.exponent_shift = plane.exponent_shift = s;
        plane.has_exponent = true;
        plane.exponent = {0, x * tile, y * tile};
      }
      planes.push_back(view);
      description.planes.push_back(plane);
      Rgb weight{};
      weight[static_cast<std::size_t>(component)] = 0.1f;
      if (!c.one_channel) weight = {0.1f, 0.05f, -0.05f};
      weights.push_back(weight);
    }
    if (c.predicts) predict(c.side);
    light.weights = weights;
  }

  /// The first plane becomes s; its normals lie one below the other in a picture of their own.
  void predict(int side) {
    const auto texels = static_cast<std::size_t>(side) * static_cast<std::size_t>(side);
    normals.resize(3 * texels);
    for (std::size_t i = 0; i < normals.size(); ++i)
      normals[i] = static_cast<std::uint16_t>(32768 + (i * 37) % 18000);
    description.prediction_plane = light.prediction_plane = 0;
    description.normal_planes = static_cast<int>(planes.size());
    weights[0] = {};
    for (Rgb& row : light.irradiance) row = {0.3f, 0.2f, 0.1f};
    for (int i = 0; i < 3; ++i) {
      PlaneView view;
      const std::uint16_t* first = normals.data() + static_cast<std::size_t>(i) * texels;
      view.mantissa = {reinterpret_cast<const std::uint8_t*>(first), 2 * std::ptrdiff_t{side}, side,
                       side, 2};
      view.mantissa_zero = 32768;
      view.scale = kNormalScale;
      planes.push_back(view);
      PlaneDescription plane;
      plane.bit_depth = 16;
      plane.mantissa = {3, 0, i * side};
      description.planes.push_back(plane);
      weights.push_back({});
    }
  }
};

/// Sheets of its own, and the barest shader: every fetch of the composite, added up. Without
/// weights, also where each plane has three.
class Floor {
 public:
  static Result<Floor> create(const Device& device, const Scene& scene) {
    Floor floor;
    floor.device_ = &device;
    StateGuard guard(device);
    RELIT_ASSIGN(floor.sheets_, PlaneSheets::create(device, scene.description));
    const int side = scene.description.width;
    const Functions& gl = device.gl();
    floor.side_ = side;
    floor.target_ = make_texture(device, half_float_format(device), side, side);
    floor.framebuffer_ = FramebufferObject(gl);
    gl.BindFramebuffer(GL_FRAMEBUFFER, floor.framebuffer_.name());
    gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D,
                            floor.target_.name(), 0);
    const std::string body = floor.text(scene);
    const std::string_view vertex[] = {shaders::composite_vert};
    const std::string_view fragment[] = {body};
    const std::string_view attributes[] = {"a_position"};
    RELIT_ASSIGN(floor.program_,
                 build_program(gl, device.profile(), {"floor", "", vertex, fragment, attributes}));
    gl.UseProgram(floor.program_.name());
    const auto size = static_cast<float>(side);
    gl.Uniform4f(gl.GetUniformLocation(floor.program_.name(), "u_texels"), size, size, 0, 0);
    for (int i = 0; i < floor.sheets_.sheet_count(); ++i)
      gl.Uniform1i(
          gl.GetUniformLocation(floor.program_.name(), ("u_sheet" + std::to_string(i)).c_str()), i);
    return floor;
  }

  Status run(std::span<const PlaneView> planes) {
    const Functions& gl = device_->gl();
    StateGuard guard(*device_, sheets_.sheet_count());
    slot_ = 1 - slot_;
    RELIT_TRY(sheets_.upload(planes, slot_));
    gl.UseProgram(program_.name());
    for (int i = sheets_.sheet_count(); i-- > 0;) {
      gl.ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(i));
      gl.BindTexture(GL_TEXTURE_2D, sheets_.texture(i, slot_));
    }
    gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
    gl.Viewport(0, 0, side_, side_);
    device_->draw_fullscreen();
    return device_->check("the floor");
  }

 private:
  [[nodiscard]] std::string text(const Scene& scene) const {
    std::string text = "VARYING vec2 v_texel;\n", body;
    for (int i = 0; i < sheets_.sheet_count(); ++i)
      text += "uniform sampler2D u_sheet" + std::to_string(i) + ";\n";
    std::vector<int> fetched;
    const auto fetch = [&](const PlaneSheets::Place& place) {
      const std::array<float, 4> at = sheets_.coordinates(place);
      char line[200];
      std::snprintf(
          line, sizeof line,
          "  sum += SAMPLE_2D(u_sheet%d, vec2(%.9f, %.9f) + v_texel * vec2(%.9f, %.9f));\n",
          place.sheet, static_cast<double>(at[0]), static_cast<double>(at[1]),
          static_cast<double>(at[2]), static_cast<double>(at[3]));
      body += line;
    };
    for (std::size_t k = 0; k < scene.planes.size(); ++k) {
      fetch(sheets_.mantissa(k));
      const PlaneSheets::Place& exponent = sheets_.exponent(k);
      if (exponent.sheet < 0) continue;
      if (std::find(fetched.begin(), fetched.end(), exponent.tile) != fetched.end()) continue;
      fetched.push_back(exponent.tile);
      fetch(exponent);
    }
    return text + "void main() {\n  vec4 sum = vec4(0.0);\n" + body + "  FRAG_COLOR = sum;\n}\n";
  }

  const Device* device_ = nullptr;
  PlaneSheets sheets_;
  int side_ = 0, slot_ = 0;
  Texture target_;
  FramebufferObject framebuffer_;
  Program program_;
};

/// Wall time, and processor time of all threads: what a software GPU costs, whoever else is busy.
struct Cost {
  double wall_s = 0, cpu_s = 0;
};

Cost cost_of(const Device& device, const std::function<Status()>& work) {
  const auto now = [](clockid_t clock) {
    timespec at{};
    clock_gettime(clock, &at);
    return static_cast<double>(at.tv_sec) + 1e-9 * static_cast<double>(at.tv_nsec);
  };
  device.gl().Finish();
  const double wall = now(CLOCK_MONOTONIC), cpu = now(CLOCK_PROCESS_CPUTIME_ID);
  const Status status = work();
  device.gl().Finish();
  if (!status) std::fprintf(stderr, "%s\n", status.error().message.c_str());
  return {now(CLOCK_MONOTONIC) - wall, now(CLOCK_PROCESS_CPUTIME_ID) - cpu};
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

Status measure(const Device& device, const Content& content) {
  constexpr int kPairs = 31;
  const Scene scene(content);
  RELIT_ASSIGN(auto compositor, Compositor::create(device, scene.description));
  RELIT_ASSIGN(Floor floor, Floor::create(device, scene));
  std::vector<double> wall, cpu, costs;
  int slot = 0;
  for (int i = 0; i < kPairs; ++i) {
    const Cost least = cost_of(device, [&] { return floor.run(scene.planes); });
    const Cost cost = cost_of(device, [&]() -> Status {
      slot = 1 - slot;
      RELIT_TRY(compositor->upload(scene.planes, slot));
      RELIT_TRY(compositor->composite(scene.light, {slot, -1, 0}));
      return {};
    });
    if (i == 0) continue;
    wall.push_back(cost.wall_s / least.wall_s);
    cpu.push_back(cost.cpu_s / least.cpu_s);
    costs.push_back(cost.wall_s);
  }
  std::printf("%-42s %dx%d: %.2f of upload and the same fetches (processor time %.2f), %.2f ms\n",
              content.name, content.side, content.side, median(wall), median(cpu),
              1e3 * median(costs));
  return {};
}

Status run() {
  RELIT_ASSIGN(auto context, OffscreenContext::create(OffscreenKind::kEglEs3));
  RELIT_ASSIGN(auto device, Device::create({context->get_proc_address(), Profile::kEs3, {}}));
  std::printf("%s\n", device->caps().renderer.c_str());
  for (const Content& content :
       {Content{"9 RGB tiles", 128, 9, 8, -1}, Content{"9 RGB tiles, 16x16 blocks", 128, 9, 8, 4},
        Content{"9 RGB tiles, exponent per texel", 128, 9, 8, 0},
        Content{"16 RGB tiles", 512, 16, 8, -1},
        Content{"48 principal planes", 512, 16, 8, -1, false},
        Content{"16 RGB tiles, 16x16 blocks", 512, 16, 8, 4},
        Content{"16 RGB tiles, 10 bit", 512, 16, 10, -1},
        Content{"15 principal planes, 10 bit", 512, 5, 10, -1, false},
        Content{"prediction and 14 principal planes, 10 bit", 128, 5, 10, -1, false, true},
        Content{"prediction and 14 principal planes, 10 bit", 512, 5, 10, -1, false, true}})
    RELIT_TRY(measure(*device, content));
  return {};
}

}  // namespace
}  // namespace relit::gles

int main() {
  const relit::Status status = relit::gles::run();
  if (!status) std::fprintf(stderr, "%s\n", status.error().message.c_str());
  return status ? 0 : 2;
}
