// SPDX-License-Identifier: MIT
#include <cstdio>

#include "decoders/sh_constants.hpp"
#include "player/command.hpp"

namespace relit::player {
namespace {

struct ProjectArguments {
  LightArguments light;
  std::vector<std::string> environments;
  std::vector<double> times_s;
  std::string output;
  int order = 3;
  bool loop = false, step = false;
  double period_s = 0;
};

// One light, or one for each time.
Result<LightField> make_field(const ProjectArguments& arguments) {
  if (arguments.times_s.size() != arguments.environments.size() &&
      !(arguments.times_s.empty() && arguments.environments.size() == 1)) {
    return fail(ErrorCode::kInvalid, std::to_string(arguments.environments.size()) +
                                         " lights need --times with as many, not " +
                                         std::to_string(arguments.times_s.size()));
  }
  LightFieldParts parts;
  parts.times_s = arguments.times_s;
  parts.loop = arguments.loop, parts.step = arguments.step, parts.period_s = arguments.period_s;
  for (const std::string& path : arguments.environments) {
    LightArguments one = arguments.light;
    one.path = path;
    RELIT_ASSIGN(LoadedLight light, load_light(one, arguments.order));
    if (light.field && arguments.times_s.empty()) return std::move(*light.field);
    if (light.field) {
      return fail(ErrorCode::kUnsupported,
                  path + ": varies already; only single lights can become keys");
    }
    parts.lights.push_back(std::move(light.light));
  }
  return LightField::create(std::move(parts));
}

int run_light(const ProjectArguments& arguments) {
  const auto field = make_field(arguments);
  if (!field) return report(field.error());
  if (const Status status = write_light_json(arguments.output, *field); !status)
    return report(status.error());
  const decoders::Light light = field->mean();
  const auto& mean = light.sh.front();
  std::fprintf(stderr, "%s: order %d, mean radiance %.4g %.4g %.4g\n", arguments.output.c_str(),
               light.order(), mean[0] * decoders::kBand0, mean[1] * decoders::kBand0,
               mean[2] * decoders::kBand0);
  return kSuccess;
}

}  // namespace

void add_light(CommandLine& line) {
  Options command =
      line.add("light", "project an environment map to spherical harmonics, for devices");
  const auto arguments = std::make_shared<ProjectArguments>();
  command
      .add("environment", arguments->environments,
           ".hdr or .exr (equirectangular), or .json; several with --times")
      .required();
  command.add("-o,--output", arguments->output, "the .json file").required();
  command.add("--order", arguments->order, "0 to 3").range(0, 3).shows_default();
  add_light_options(command, arguments->light);
  Option times =
      command.add("--times", arguments->times_s, "T,T,…: seconds at which each light holds")
          .delimiter(',');
  command.flag("--loop", arguments->loop, "from the last light to the first again").needs(times);
  command.add("--period", arguments->period_s, "seconds after which the first comes again")
      .needs(times);
  command.flag("--step", arguments->step, "from light to light at once, without blending")
      .needs(times);
  command.footer(
      "Examples:\n"
      "  relit light sky.hdr -o sky.json --rotate-light 90 --light-window\n"
      "  relit light dawn.hdr noon.hdr dusk.hdr --times 0,4,8 -o day.json");
  command.runs([arguments] { return run_light(*arguments); });
}

}  // namespace relit::player
