// SPDX-License-Identifier: MIT
#include <cstdio>
#include <nlohmann/json.hpp>

#include "player/command.hpp"
#include "player/recover.hpp"
#include "player/source.hpp"

namespace relit::player {
namespace {

using nlohmann::ordered_json;

struct RecoverArguments {
  std::string source, output;
  bool json = false;
};

std::string text(const std::vector<FrameRun>& spans) {
  std::string all;
  for (const FrameRun& s : spans) {
    if (!all.empty()) all += ", ";
    all += std::to_string(s.first);
    if (s.last != s.first) all += "-" + std::to_string(s.last);
  }
  return all;
}

ordered_json to_json(const RecoverReport& report) {
  ordered_json tracks = ordered_json::array();
  for (const TrackLoss& t : report.tracks) {
    ordered_json frames = ordered_json::array();
    for (const FrameRun& s : t.frames) frames.push_back({s.first, s.last});
    tracks.push_back({{"clip", t.clip_id},
                      {"clip_name", t.clip},
                      {"track", t.track},
                      {"what", t.what},
                      {"missing_frames", frames}});
  }
  return {{"clean", report.clean()},
          {"source_bytes", report.source_bytes},
          {"damaged_bytes", report.damaged_bytes},
          {"segments", report.segments},
          {"partial_segments", report.partial_segments},
          {"lost_segments", report.lost_segments},
          {"repaired", report.repaired},
          {"lost", report.lost},
          {"tracks", tracks}};
}

/// Names come out of files that are known to be damaged: no control character reaches a terminal.
std::string printable(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = '?';
  return text;
}

void print(const RecoverReport& report, const std::string& name) {
  const auto say = [&](const std::string& what) {
    std::fprintf(stderr, "relit: %s: %s\n", name.c_str(), printable(what).c_str());
  };
  for (const std::string& what : report.repaired) say("repaired: " + what);
  for (const std::string& what : report.lost) say("lost: " + what);
  for (const TrackLoss& t : report.tracks)
    say("missing: clip \"" + t.clip + "\", " + t.what + " (track " + std::to_string(t.track) +
        "): frames " + text(t.frames));
  say(std::to_string(report.segments) + " segments kept" +
      (report.partial_segments > 0
           ? ", " + std::to_string(report.partial_segments) + " of them in part"
           : "") +
      ", " + std::to_string(report.lost_segments) + " lost; " +
      std::to_string(report.damaged_bytes) + " of " + std::to_string(report.source_bytes) +
      " bytes damaged");
}

Result<RecoverReport> recover_file(const RecoverArguments& arguments) {
  RELIT_ASSIGN(const auto source, open_source(arguments.source));
  if (!source->seekable() || !source->size())
    return fail(ErrorCode::kInvalid,
                arguments.source + ": recover goes over a file several times: save it first");
  RELIT_ASSIGN(const auto sink, container::FileSink::create(arguments.output));
  auto report = recover(*source, *sink);
  if (!report) return fail(report.error().code, arguments.source + ": " + report.error().message);
  RELIT_TRY(sink->commit());
  return report;
}

int run_recover(const RecoverArguments& arguments) {
  const auto report_of = recover_file(arguments);
  if (!report_of) return report(report_of.error());
  print(*report_of, arguments.source);
  if (arguments.json) {
    std::printf(
        "%s\n",
        to_json(*report_of).dump(2, ' ', false, ordered_json::error_handler_t::replace).c_str());
  }
  return report_of->clean() ? kSuccess : kWithLosses;
}

}  // namespace

void add_recover(CommandLine& line) {
  Options command =
      line.add("recover", "write what is left of a damaged or cut file as a complete one");
  const auto arguments = std::make_shared<RecoverArguments>();
  command.add("source", arguments->source, "the damaged file").required();
  command.add("output", arguments->output, "the new file").required();
  command.flag("--json", arguments->json, "say what happened as JSON, to standard output");
  command.footer(
      "Exit status: 0 everything was kept, 3 something was lost, 1 nothing usable, and no file is "
      "written.\n\n"
      "JSON: {\"clean\": bool, \"source_bytes\", \"damaged_bytes\", \"segments\" (written), "
      "\"partial_segments\" (of these, without some of their tracks), \"lost_segments\",\n"
      "  \"repaired\": [text], \"lost\": [text],\n"
      "  \"tracks\": [{\"clip\": id, \"clip_name\", \"track\": id, \"what\": \"pose\" | \"layer "
      "ID\" | \"exponents of layer ID\", \"missing_frames\": [[first, last], ...]}]}\n"
      "missing_frames are the frames of the clip that the new file lacks in that track.");
  command.runs([arguments] { return run_recover(*arguments); });
}

}  // namespace relit::player
