// SPDX-License-Identifier: MIT
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "player/command.hpp"
#include "player/memory_plan.hpp"
#include "player/video_tracks.hpp"

namespace relit::player {
namespace {

struct PlanArguments {
  SourceArguments source;
  MemoryWishes wishes;
  std::string budget, path = "auto", size = "1280x720";
  int samples = 4, background = 512;
  bool headless = false, json = false;
};

/// 0: the system does not say.
std::uint64_t machine_bytes() {
  const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
  if (pages <= 0 || page <= 0) return 0;
  return static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(page);
}

Status complete(PlanArguments& arguments) {
  RELIT_ASSIGN(arguments.wishes.path, parse_composite_path(arguments.path));
  if (arguments.headless) return {};
  DrawingScale& drawing = arguments.wishes.drawing.emplace();
  int used = 0;
  const bool read = std::sscanf(arguments.size.c_str(), "%5dx%5d%n", &drawing.framebuffer_width,
                                &drawing.framebuffer_height, &used) == 2;
  if (!read || used != static_cast<int>(arguments.size.size()) || drawing.framebuffer_width < 1 ||
      drawing.framebuffer_height < 1) {
    return fail(ErrorCode::kInvalid, "--size " + arguments.size + ": the form is 1280x720");
  }
  drawing.samples = arguments.samples;
  drawing.background_side = arguments.background;
  return {};
}

struct Loaded {
  container::FileContents contents;
  SegmentScale segments;
};

Result<Loaded> load(const PlanArguments& arguments) {
  RELIT_ASSIGN(auto source, open_source(arguments.source, true));
  container::ReaderOptions options;
  options.sparing = true;
  RELIT_ASSIGN(auto reader, container::Reader::open(std::move(source), options));
  Loaded loaded;
  RELIT_ASSIGN(loaded.contents, container::load_static(reader));
  RELIT_ASSIGN(const container::ClipRecord* clip,
               find_clip(loaded.contents, arguments.wishes.clip, arguments.source.name));
  RELIT_ASSIGN(loaded.segments, largest_segment(reader, *clip));
  return loaded;
}

const char* light_map_name(gles::LightMapFormat format) {
  if (format == gles::LightMapFormat::kSquareRoot8) return "8-bit square roots";
  return format == gles::LightMapFormat::kFloat ? "floats" : "half floats";
}

nlohmann::ordered_json plan_json(const MemoryPlan& plan, std::optional<std::uint64_t> budget) {
  nlohmann::ordered_json json;
  json["fits"] = true;
  json["budget_bytes"] = budget ? nlohmann::ordered_json(*budget) : nlohmann::ordered_json();
  json["heap_bytes"] = plan.heap_bytes();
  json["gpu_bytes"] = plan.gpu_bytes();
  json["total_bytes"] = plan.total_bytes();
  json["ring"] = {
      {"frames", plan.ring_frames}, {"bytes", plan.ring_bytes}, {"frame_bytes", plan.frame_bytes}};
  json["packet_bytes"] = plan.packet_bytes;
  json["threads"] = plan.threads;
  json["decoder_threads"] = plan.decoder_threads;
  json["layers"] = plan.layers;
  json["path"] = composite_path_name(plan.path);
  json["light_map"] = light_map_name(plan.light_map);
  json["terms"] = nlohmann::ordered_json::array();
  for (const MemoryTerm& term : plan.terms) {
    json["terms"].push_back({{"name", term.name},
                             {"what", term.what},
                             {"heap_bytes", term.heap_bytes},
                             {"gpu_bytes", term.gpu_bytes}});
  }
  json["given_up"] = plan.given_up;
  return json;
}

void print(const MemoryPlan& plan, bool headless) {
  const auto number = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  std::printf("%12s %12s\n", "heap", "GPU");
  for (const MemoryTerm& term : plan.terms) {
    std::printf("%12llu %12llu  %s: %s\n", number(term.heap_bytes), number(term.gpu_bytes),
                term.name.c_str(), term.what.c_str());
  }
  std::printf("%12llu %12llu  in all, %.1f MiB\n", number(plan.heap_bytes()),
              number(plan.gpu_bytes()), static_cast<double>(plan.total_bytes()) / (1 << 20));
  std::printf("%llu frames ahead, %d %s, %d of %zu layers", number(plan.ring_frames), plan.threads,
              plan.threads == 1 ? "thread" : "threads", plan.layer_count(), plan.layers.size());
  if (!headless) {
    std::printf(", composite: %s, light map: %s", composite_path_name(plan.path),
                light_map_name(plan.light_map));
  }
  std::printf("\n");
  for (const std::string& sentence : plan.given_up) std::printf("given up: %s\n", sentence.c_str());
}

int refuse(const PlanArguments& arguments, const Loaded& loaded, const Error& error) {
  const auto smallest = smallest_budget(loaded.contents, loaded.segments, arguments.wishes);
  if (arguments.json && smallest) {
    nlohmann::ordered_json json;
    json["fits"] = false;
    json["smallest_bytes"] = *smallest;
    std::printf("%s\n", json.dump(2).c_str());
  }
  report_in(arguments.source.name, error);
  return kBadInput;
}

int run_plan(PlanArguments arguments) {
  if (const Status status = complete(arguments); !status) return report(status.error());
  std::optional<std::uint64_t> budget;
  if (!arguments.budget.empty()) {
    const auto bytes = parse_bytes(arguments.budget);
    if (!bytes) return report({bytes.error().code, "--memory-budget " + bytes.error().message});
    budget = *bytes;
  }
  const auto loaded = load(arguments);
  if (!loaded) return report_in(arguments.source.name, loaded.error());
  // What the machine has is a budget, whatever was asked for.
  std::optional<std::uint64_t> limit = budget;
  if (const std::uint64_t machine = machine_bytes(); machine != 0) {
    limit = std::min(budget.value_or(machine), machine);
  }
  const auto plan = plan_memory(loaded->contents, loaded->segments, arguments.wishes, limit);
  if (!plan && plan.error().code == ErrorCode::kOutOfMemory)
    return refuse(arguments, *loaded, plan.error());
  if (!plan) return report_in(arguments.source.name, plan.error());
  if (arguments.json) {
    std::printf("%s\n", plan_json(*plan, budget).dump(2).c_str());
  } else {
    print(*plan, arguments.headless);
  }
  return kSuccess;
}

}  // namespace

void add_plan(CommandLine& line) {
  Options command = line.add("plan", "say what memory playing a file takes");
  const auto arguments = std::make_shared<PlanArguments>();
  add_source_options(command, arguments->source, "path, - or http(s)://");
  command.add("--memory-budget", arguments->budget,
              "bytes of heap and GPU together, such as 32MiB; as much as the machine has");
  command.add("--clip", arguments->wishes.clip, "by name or number");
  command.add("--with", arguments->wishes.others,
              "another clip of a sequence, by name or number; repeatable. Two of them play "
              "at once in a cross-fade");
  command.add("--layers", arguments->wishes.layers, "only the first so many layers");
  command.add("--threads", arguments->wishes.threads, "decode workers").range(1, 64);
  command.add("--ring", arguments->wishes.ring_frames,
              "frames decoded ahead (default: a quarter of a second)");
  command.add("--composite", arguments->path, "auto, cpu, texture or fused").shows_default();
  command.add("--size", arguments->size, "of the picture").shows_default();
  command.add("--samples", arguments->samples, "of the picture's pixels: 1, 4 or 16")
      .one_of({1, 4, 16})
      .shows_default();
  command.add("--background-side", arguments->background, "of the background's cube map; 0: none")
      .range(0, 1024)
      .shows_default();
  command.flag("--headless", arguments->headless, "nothing is drawn, as in relit stream");
  command.flag("--json", arguments->json, "as JSON, to standard output");
  command.footer(
      "What does not fit is given up in this order: frames ahead, threads, the choice of composite "
      "path, the light map's precision, layers.\nExit status: 1 if no plan fits.");
  command.runs([arguments] { return run_plan(*arguments); });
}

}  // namespace relit::player
