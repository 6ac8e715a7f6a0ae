// SPDX-License-Identifier: MIT
#include <unistd.h>

#include <cstdio>
#include <set>

#include "container/byte_sink.hpp"
#include "player/command.hpp"
#include "player/measure_html.hpp"
#include "player/measure_run.hpp"
#include "player/measure_text.hpp"

namespace relit::player {
namespace {

struct MeasureArguments {
  MeasureRun run;
  std::string csv, json, html;
};

// Opened first, so that minutes are not spent for a place that cannot be written.
struct MeasureOutputs {
  std::unique_ptr<container::FileSink> csv, json, html;

  static Result<MeasureOutputs> create(const MeasureArguments& arguments) {
    MeasureOutputs outputs;
    const auto open = [](const std::string& path,
                         std::unique_ptr<container::FileSink>& sink) -> Status {
      if (path.empty()) return {};
      RELIT_ASSIGN(sink, container::FileSink::create(path));
      return {};
    };
    RELIT_TRY(open(arguments.csv, outputs.csv));
    RELIT_TRY(open(arguments.json, outputs.json));
    RELIT_TRY(open(arguments.html, outputs.html));
    return outputs;
  }
};

Status write_text(const std::unique_ptr<container::FileSink>& sink, const std::string& text) {
  RELIT_TRY(sink->write({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}));
  return sink->commit();
}

Status write_measured(const MeasureOutputs& outputs, const MeasureReport& report) {
  if (outputs.csv) RELIT_TRY(write_text(outputs.csv, measure_csv(report)));
  if (outputs.json) {
    RELIT_TRY(write_text(
        outputs.json,
        measure_json(report).dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) +
            "\n"));
  }
  if (outputs.html) RELIT_TRY(write_text(outputs.html, measure_html(report)));
  return {};
}

int run_measure(MeasureArguments arguments) {
  const auto outputs = MeasureOutputs::create(arguments);
  if (!outputs) return report(outputs.error());
  const bool shows = isatty(STDERR_FILENO) != 0;
  arguments.run.progress = [shows](const std::string& what) {
    if (shows) std::fprintf(stderr, "\r%s\033[K", what.c_str());
  };
  arguments.run.warn = &warn;
  arguments.run.pictures = !arguments.html.empty();
  const auto measured = measure(arguments.run);
  if (shows) std::fprintf(stderr, "\r\033[K");
  if (!measured) return report(measured.error());
  std::fputs(measure_table(*measured).c_str(), stdout);
  if (const Status written = write_measured(*outputs, *measured); !written)
    return report(written.error());
  int status = kSuccess;
  std::set<std::string> said;
  for (const MeasuredPoint& point : measured->points) {
    const std::string& file = measured->files[point.file].path;
    if (point.lost_frames > 0) said.insert(file + ": frames are lost to damage");
    if (!point.scored())
      said.insert(file + ": " + point_label(*measured, point) + ": " + point.failure);
    if (point.lost_frames > 0 || (!point.scored() && !point.impossible)) status = kWithLosses;
  }
  for (const std::string& sentence : said) warn(sentence);
  return status;
}

}  // namespace

void add_measure(CommandLine& line) {
  Options command =
      line.add("measure", "size, error, time and memory of files and ways to play them");
  const auto a = std::make_shared<MeasureArguments>();
  MeasureRun& r = a->run;
  command.add("files", r.files, "one or more .relit files of one clip").required();
  command.add("--reference", r.reference,
              "what they are scored against: the .npy of relit-bake --reference, or a .relit; "
              "without one the first file, all of it decoded");
  command.add("--clip", r.clip, "by name or number");
  command
      .add("--lights", r.lights,
           ".hdr, .exr or .json, in place of the 16 standard lights; repeatable")
      .expected(1, 1);
  command.add("--frames", r.frames, "score so many, evenly spread; 0: all").shows_default();
  command.add("--planes", r.sweep.planes,
              "list of numbers, all, layers (the end of each): drops planes from the end");
  command.add("--composite", r.sweep.composite, "list of cpu, texture, fused");
  command.add("--backend", r.sweep.backend,
              "list of egl, egl-es2, egl-es2-mediump, osmesa: of the paths on the GPU");
  command.add("--threads", r.sweep.threads, "list of decode threads");
  command.add("--every", r.sweep.every, "list of N: one frame in N is decoded, the others blended");
  command.flag(
      "--product", r.sweep.product,
      "all combinations of the lists; otherwise the first values, and each list by itself");
  command.add("--repeats", r.meter.repeats, "of decoding the clip, for the median")
      .range(1, 99)
      .shows_default();
  command.add("--picture-frame", r.picture_frame,
              "whose pictures the page shows: the nearest that is scored");
  command.add("--csv", a->csv, "write the points as comma-separated values");
  command.add("--json", a->json, "write everything as JSON");
  command.add("--html", a->html, "write one page with plots and pictures");
  command.footer(
      "With one file, lists that are not given vary every knob; with several they hold the best\n"
      "quality, and the files are what is compared. MEASURE.md says what the columns mean.\n"
      "Examples:\n"
      "  relit measure man.relit\n"
      "  relit measure man-*.relit --reference man.npy --csv man.csv --html man.html\n"
      "  relit measure man.relit --planes all,12,6,1 --composite cpu,texture --product");
  command.runs([a] { return run_measure(*a); });
}

}  // namespace relit::player
