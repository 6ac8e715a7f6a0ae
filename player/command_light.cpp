// SPDX-License-Identifier: MIT
#include <cstdio>

#include "decoders/sh_constants.hpp"
#include "player/command.hpp"

namespace relit::player {
namespace {

struct Arguments {
  LightArguments light;
  std::string output;
  int order = 3;
};

int run(const Arguments& arguments) {
  auto light = load_light(arguments.light, arguments.order);
  if (!light) return report(light.error());
  if (const Status status = write_light_json(arguments.output, light->light); !status)
    return report(status.error());
  const auto& mean = light->light.sh.front();
  std::fprintf(stderr, "%s: order %d, mean radiance %.4g %.4g %.4g\n", arguments.output.c_str(),
               light->light.order(), mean[0] * decoders::kBand0, mean[1] * decoders::kBand0,
               mean[2] * decoders::kBand0);
  return kSuccess;
}

}  // namespace

Command add_light(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("light", "project an environment map to spherical harmonics, for devices");
  const auto arguments = std::make_shared<Arguments>();
  command
      ->add_option("environment", arguments->light.path, ".hdr or .exr (equirectangular), or .json")
      ->required();
  command->add_option("-o,--output", arguments->output, "the .json file")->required();
  command->add_option("--order", arguments->order, "0 to 3")
      ->check(CLI::Range(0, 3))
      ->capture_default_str();
  add_light_options(*command, arguments->light);
  command->footer("Example:\n  relit light sky.hdr -o sky.json --rotate-light 90 --light-window");
  return [arguments] { return run(*arguments); };
}

}  // namespace relit::player
