// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numeric>
#include <utility>

#include "bake_minimal/bake.hpp"

using namespace relit;
using namespace relit::bake;

namespace {

constexpr int kBadInput = 1;
constexpr int kUsage = 2;

constexpr const char* kExamples = R"(Examples:
  relit-bake CesiumMan.glb man.relit
      its first clip at 50 frames/s, order 2, 128x128 texels
  relit-bake fox.glb fox.relit --clip Walk --ground --size 192 --samples 2048
      one clip of several, on a disc that receives its shadow
  relit-bake robot.glb robot.relit --lightmap-uv unwrap --crf 14
      new light-map UVs, finer quantisation
  relit-bake man.glb man.relit --target-psnr 40
      the smallest file of that quality, and what was tried for it
  relit-bake man.glb paper.relit --preset paper --reference man.npy
      the scheme of Xu et al. and the unquantised bake, to compare

Exit status: 0 success, 1 the input is bad, 2 usage or environment.)";

// What the options say before they mean something to the baker.
struct Arguments {
  BakeOptions bake;
  std::string clip, lightmap_uv = "auto", layout = "layered", preset, chroma, model = "shlm",
                    planes = "auto", sweep, pose = "auto", fps = "50", budget, profile;
  std::vector<int> size{128};
  double crf = 0, target_psnr = 0, target_error = 0, ground_radius = 0;
  int bit_depth = 0;
  std::vector<float> ground_color;
  bool list_clips = false, json = false, quiet = false, once = false, ground = false,
       no_prediction = false;
};

int report(const Error& error) {
  std::fprintf(stderr, "relit-bake: %s\n", error.message.c_str());
  const bool usage = error.code == ErrorCode::kInvalid || error.code == ErrorCode::kEnvironment ||
                     error.code == ErrorCode::kOutOfMemory;
  return usage ? kUsage : kBadInput;
}

// Bytes a second from "1Mbit/s", "800kbit/s" or "125kB/s".
Result<double> parse_budget(const std::string& text) {
  constexpr std::pair<const char*, double> kUnits[] = {{"bit/s", 1.0 / 8},  {"kbit/s", 1e3 / 8},
                                                       {"Mbit/s", 1e6 / 8}, {"B/s", 1},
                                                       {"kB/s", 1e3},       {"MB/s", 1e6}};
  double value = 0;
  int used = 0;
  if (std::sscanf(text.c_str(), "%lf%n", &value, &used) == 1 && std::isfinite(value) && value > 0) {
    for (const auto& [unit, bytes] : kUnits)
      if (text.substr(static_cast<std::size_t>(used)) == unit) return value * bytes;
  }
  return fail(ErrorCode::kInvalid, "--budget " + text +
                                       ": it must be a positive number and one of bit/s, kbit/s, "
                                       "Mbit/s, B/s, kB/s, MB/s, such as 1Mbit/s");
}

// "50", "23.976" or "30000/1001".
Result<container::Rational> parse_rate(const std::string& text) {
  long long num = 0, den = 1;
  int used = 0;
  const int length = static_cast<int>(text.size());
  if (std::sscanf(text.c_str(), "%lld/%lld%n", &num, &den, &used) == 2 && used == length) {
    if (num > 0 && den > 0 && num <= 1'000'000'000 && den <= 1'000'000'000)
      return container::Rational{num, den};
  } else {
    double value = 0;
    if (std::sscanf(text.c_str(), "%lf%n", &value, &used) == 1 && used == length && value > 0 &&
        value <= 100000) {
      num = std::llround(value * 1000);
      const long long common = std::gcd(num, 1000ll);
      if (num > 0) return container::Rational{num / common, 1000 / common};
    }
  }
  return fail(
      ErrorCode::kInvalid,
      "--fps " + text +
          ": it must be a number of frames per second up to 100000, such as 50 or 30000/1001");
}

void add_options(CLI::App& app, Arguments& a) {
  app.add_option("input", a.bake.input, "the character: .gltf or .glb")->required();
  app.add_option("output", a.bake.output, "the .relit file to write");
  app.add_option("--clip", a.clip, "animation, by name or number (default: the first)");
  app.add_flag("--list-clips", a.list_clips, "say which animations there are, and stop");
  app.add_option("--fps", a.fps, "frames per second, such as 50 or 30000/1001")
      ->capture_default_str();
  app.add_option("--max-frames", a.bake.max_frames,
                 "stop after so many frames (0: the whole clip)");
  app.add_flag("--once", a.once, "the clip does not loop");

  app.add_option("--order", a.bake.transfer.order, "order of the spherical harmonics, 0 to 3")
      ->capture_default_str()
      ->group("Transfer");
  app.add_option("--size", a.size, "texels of the light map: N, or W H")
      ->expected(1, 2)
      ->group("Transfer")
      ->default_str("128");
  app.add_option("--samples", a.bake.transfer.directions,
                 "directions over the sphere, for every texel and frame the same")
      ->capture_default_str()
      ->group("Transfer");
  app.add_option("--bounces", a.bake.transfer.bounces, "interreflections")
      ->capture_default_str()
      ->group("Transfer");
  app.add_option("--seed", a.bake.transfer.seed, "turns the directions")
      ->capture_default_str()
      ->group("Transfer");
  app.add_option("--lightmap-uv", a.lightmap_uv,
                 "N: that UV set; auto: the first that does not overlap, else unwrap; unwrap")
      ->capture_default_str()
      ->group("Transfer");
  app.add_flag("--ground", a.ground,
               "add a disc under the feet that takes the shadow and gives back light")
      ->group("Transfer");
  app.add_option("--ground-radius", a.ground_radius,
                 "of the disc, over half the width of the clip (default: 1.6)")
      ->group("Transfer");
  app.add_option("--ground-color", a.ground_color, "linear albedo of the disc: R G B")
      ->expected(3)
      ->group("Transfer");
  app.add_option("--threads", a.bake.transfer.threads, "0: one per processor; changes no byte")
      ->capture_default_str()
      ->group("Transfer");

  app.add_option("--model", a.model, "appearance model: shlm")
      ->check(CLI::IsMember({"shlm"}))
      ->capture_default_str()
      ->group("Coding");
  app.add_option("--preset", a.preset,
                 "paper: RGBE mantissas through MPEG-4, exponents per texel (Xu et al.)")
      ->check(CLI::IsMember({"paper"}))
      ->group("Coding");
  app.add_option("--codec", a.bake.coding.codec,
                 "of the mantissas: h264, mpeg4, ffv1, hevc, vp9, av1")
      ->capture_default_str()
      ->group("Coding");
  app.add_option("--crf", a.crf,
                 "quality: lower is better and larger, 6 less about doubles the bytes")
      ->group("Coding");
  app.add_flag("--lossless", a.bake.coding.lossless, "code the mantissas without loss")
      ->group("Coding");
  app.add_option("--bit-depth", a.bit_depth, "of the mantissas")
      ->check(CLI::IsMember({8, 10}))
      ->group("Coding");
  app.add_option("--chroma", a.chroma, "420, 444 or luma")
      ->check(CLI::IsMember({"420", "444", "luma"}))
      ->group("Coding");
  app.add_option("--planes", a.planes,
                 "what the planes are: colour (the channels of each coefficient), principal (the "
                 "axes of what the mesh's normals do not predict), auto")
      ->check(CLI::IsMember({"auto", "colour", "principal"}))
      ->capture_default_str()
      ->group("Coding");
  app.add_option("--principal-count", a.bake.coding.principal_count,
                 "principal planes at most; 0: all that show")
      ->capture_default_str()
      ->group("Coding");
  app.add_flag("--no-prediction", a.no_prediction,
               "principal planes of all of the transfer, the normals aside")
      ->group("Coding");
  app.add_option(
         "--exponent-block", a.bake.coding.exponent_block,
         "side of the square of texels that shares an exponent: 1 to 32, a power of two; 0: none")
      ->capture_default_str()
      ->group("Coding");
  app.add_option("--exponent-hold", a.bake.coding.exponent_hold,
                 "frames that share exponents; 0: the segment")
      ->capture_default_str()
      ->group("Coding");
  app.add_option("--segment", a.bake.segment_s, "seconds that can be decoded by themselves")
      ->capture_default_str()
      ->group("Coding");
  app.add_option("--frame-step", a.bake.coding.frame_step,
                 "keep every so many frames of those traced, and have players blend in between; 0: "
                 "all, or what a target takes")
      ->capture_default_str()
      ->group("Coding");
  app.add_option("--layout", a.layout, "layered or grid")
      ->check(CLI::IsMember({"layered", "grid"}))
      ->capture_default_str()
      ->group("Coding");
  app.add_option("--encoder-preset", a.bake.coding.preset, "the encoder's own speed preset")
      ->group("Coding");
  app.add_option("--decode-memory", a.bake.coding.decode_memory,
                 "bytes that the decoders' pictures may take (such as 16MiB), by fewer references "
                 "and less reordering; 0: no bound")
      ->transform(CLI::AsSizeValue(false))
      ->group("Coding");
  app.add_option("--pose", a.pose, "auto, joints or vertices")
      ->check(CLI::IsMember({"auto", "joints", "vertices"}))
      ->capture_default_str()
      ->group("Coding");
  app.add_flag("--normals", a.bake.write_normals,
               "write the normals, for hosts that shade for themselves, in any case")
      ->group("Coding");

  app.add_option("--profile", a.profile,
                 "hardware: what hardware decoders take, H.264 of 8 bits in 4:2:0")
      ->check(CLI::IsMember({"hardware"}))
      ->excludes("--codec", "--chroma", "--bit-depth", "--preset")
      ->group("Coding");

  CLI::Option* const psnr =
      app.add_option("--target-psnr", a.target_psnr,
                     "seek the smallest coding with this relit PSNR, dB over the standard lights; "
                     "the codec too, unless --codec names one")
          ->check(CLI::Range(10.0, 100.0))
          ->excludes("--crf")
          ->group("Goal");
  CLI::Option* const error =
      app.add_option("--target-error", a.target_error,
                     "likewise for the 99th percentile of the error, relative to the peak: 0.01")
          ->check(CLI::Range(1e-6, 0.5))
          ->excludes("--crf", psnr)
          ->group("Goal");
  app.add_option("--budget", a.budget,
                 "seek the best coding of which a second takes no more, as 1Mbit/s or 125kB/s; "
                 "what is sent once comes on top")
      ->excludes("--crf", psnr, error)
      ->group("Goal");
  app.add_option("--sweep", a.sweep,
                 "code one trace in several ways, such as \"codec=h264,hevc crf=12,18,24\": "
                 "OUT-h264-crf12.relit and so on")
      ->group("Coding");
  app.add_option("--reference", a.bake.reference,
                 "write the unquantised bake as .npy, float32 [frames][coefficients][3][H][W]");
  app.add_flag("--json", a.json, "print a summary to standard output");
  app.add_flag("-q,--quiet", a.quiet, "no progress");
}

Status complete(Arguments& a, const CLI::App& app) {
  BakeOptions& bake = a.bake;
  if (!a.clip.empty()) bake.clip = a.clip;
  RELIT_ASSIGN(bake.frame_rate, parse_rate(a.fps));
  bake.transfer.width = a.size.front(), bake.transfer.height = a.size.back();
  bake.loop = !a.once;
  if (a.lightmap_uv == "unwrap") {
    bake.atlas.source = AtlasOptions::Source::kUnwrap;
  } else if (a.lightmap_uv != "auto") {
    if (a.lightmap_uv.size() > 2 ||
        a.lightmap_uv.find_first_not_of("0123456789") != std::string::npos) {
      return fail(ErrorCode::kInvalid, "--lightmap-uv " + a.lightmap_uv +
                                           ": it must be auto, unwrap or the number of a UV set");
    }
    bake.atlas.source = AtlasOptions::Source::kSet;
    bake.atlas.set = std::stoi(a.lightmap_uv);
  }
  if (a.ground || app.count("--ground-radius") > 0 || app.count("--ground-color") > 0) {
    bake.ground.emplace();
    if (app.count("--ground-radius") > 0) bake.ground->radius = a.ground_radius;
    if (a.ground_color.size() == 3)
      bake.ground->albedo = {a.ground_color[0], a.ground_color[1], a.ground_color[2]};
  }
  if (a.preset == "paper") {
    const CodingOptions given = bake.coding;
    bake.coding = paper_options();
    bake.coding.threads = given.threads;
    bake.coding.decode_memory = given.decode_memory;
  }
  if (a.layout == "grid" && a.preset.empty()) bake.coding.layout = Layout::kGrid;
  if (a.planes == "colour") bake.coding.planes = Planes::kColour;
  if (a.planes == "principal") bake.coding.planes = Planes::kPrincipal;
  if (a.no_prediction) bake.coding.predict = false;
  if (app.count("--crf") > 0) bake.coding.crf = a.crf;
  if (a.bit_depth != 0) bake.coding.bit_depth = a.bit_depth;
  if (a.chroma == "420") bake.coding.chroma = container::Chroma::k420;
  if (a.chroma == "444") bake.coding.chroma = container::Chroma::k444;
  if (a.chroma == "luma") bake.coding.chroma = container::Chroma::kLuma;
  if (a.profile == "hardware") {
    RELIT_ASSIGN(bake.coding, hardware_options(bake.coding));
  }
  if (app.count("--target-psnr") > 0) bake.goal = Goal{Goal::Kind::kPsnr, a.target_psnr};
  if (app.count("--target-error") > 0) bake.goal = Goal{Goal::Kind::kError, a.target_error};
  if (!a.budget.empty()) {
    RELIT_ASSIGN(const double bytes, parse_budget(a.budget));
    bake.goal = Goal{Goal::Kind::kBudget, bytes};
  }
  const bool any_codec = app.count("--codec") == 0 && a.preset.empty() && a.profile.empty();
  if (bake.goal) bake.candidates = coding_candidates(bake.coding, any_codec);
  if (!a.sweep.empty()) {
    RELIT_ASSIGN(bake.sweep, expand_sweep(a.sweep, bake.coding));
  }
  bake.pose = a.pose == "joints"     ? PoseChoice::kJoints
              : a.pose == "vertices" ? PoseChoice::kVertices
                                     : PoseChoice::kAuto;
  return {};
}

int list_clips(const std::filesystem::path& input) {
  const Result<Scene> scene = load_gltf(input);
  if (!scene) return report(scene.error());
  for (std::size_t i = 0; i < scene->clips.size(); ++i) {
    std::printf("%zu  %-24s %.3f s\n", i, scene->clips[i].name.c_str(), scene->clips[i].duration_s);
  }
  if (scene->clips.empty()) std::printf("no animation: the rest pose bakes as one frame\n");
  return 0;
}

const char* outcome_name(const CandidateReport& report) {
  switch (report.outcome) {
    case CandidateReport::Outcome::kReached:
      return "reached";
    case CandidateReport::Outcome::kAbandoned:
      return "abandoned";
    case CandidateReport::Outcome::kOutOfReach:
      return "out of reach";
    case CandidateReport::Outcome::kUnavailable:
      return "no such encoder here";
  }
  return "";
}

nlohmann::ordered_json trial_json(const CodingTrial& trial) {
  return {{"crf", trial.crf},
          {"segment_bytes", trial.bytes},
          {"relit_psnr_db", trial.figures.psnr_db},
          {"error_p99", trial.figures.p99}};
}

nlohmann::ordered_json summary_json(const BakeSummary& s) {
  nlohmann::ordered_json json;
  json["output"] = s.output.string();
  json["clip"] = s.clip;
  json["frames"] = s.frames;
  json["fps"] = {s.frame_rate.num, s.frame_rate.den};
  json["order"] = s.order;
  json["size"] = {s.width, s.height};
  json["vertices"] = s.vertices;
  json["triangles"] = s.triangles;
  json["texels"] = {{"covered", s.covered}, {"sampled", s.samples}};
  json["lightmap_uv"] = {{"set", s.atlas.set},
                         {"charts", s.atlas.charts},
                         {"coverage", s.atlas.coverage},
                         {"density_p5", s.atlas.density_p5},
                         {"density_p95", s.atlas.density_p95},
                         {"reason", s.atlas.reason}};
  json["rays"] = s.rays;
  json["t0"] = {s.least_t0, s.largest_t0};
  json["codec"] = s.coding.codec;
  json["crf"] = *s.coding.crf;
  if (s.choice) {
    json["relit_psnr_db"] = s.choice->trial.figures.psnr_db;
    json["error_p99"] = s.choice->trial.figures.p99;
    json["candidates"] = nlohmann::ordered_json::array();
    for (const CandidateReport& report : s.choice->reports) {
      nlohmann::ordered_json each = {{"name", report.name}, {"outcome", outcome_name(report)}};
      if (report.outcome != CandidateReport::Outcome::kUnavailable)
        each.update(trial_json(report.best));
      each["tries"] = report.tries;
      json["candidates"].push_back(std::move(each));
    }
    json["coarser_and_finer"] = nlohmann::ordered_json::array();
    for (const CodingTrial& trial : s.choice->coarser_and_finer)
      json["coarser_and_finer"].push_back(trial_json(trial));
  }
  json["seconds"] = {{"trace", s.trace_s}, {"code", s.code_s}};
  json["bytes"] = {{"file", s.bytes},        {"images", s.image_bytes},
                   {"meshes", s.mesh_bytes}, {"pose", s.pose_bytes},
                   {"video", s.video_bytes}, {"decoder_pictures", s.decoder_bytes}};
  json["warnings"] = s.warnings;
  return json;
}

/// An object, or for a sweep a list of them.
void print_json(const std::vector<BakeSummary>& summaries, const BakeOptions& options) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const BakeSummary& summary : summaries) json.push_back(summary_json(summary));
  if (options.sweep.empty()) json = nlohmann::ordered_json(json.front());
  std::printf("%s\n", json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace).c_str());
}

void print_trial(const std::string& name, const CodingTrial& trial, const char* remark) {
  std::fprintf(stderr, "  %-12s crf %-6g %10llu bytes %7.2f dB  p99 %.4f  %s\n", name.c_str(),
               trial.crf, static_cast<unsigned long long>(trial.bytes), trial.figures.psnr_db,
               trial.figures.p99, remark);
}

/// What was tried, what it came to, and what a step up or down would cost.
void print_choice(const CodingChoice& choice, const CodingOptions& coding) {
  std::fprintf(stderr, "light and pose of all segments, by what was tried:\n");
  for (std::size_t i = 0; i < choice.reports.size(); ++i) {
    const CandidateReport& report = choice.reports[i];
    if (report.outcome == CandidateReport::Outcome::kUnavailable) {
      std::fprintf(stderr, "  %-12s %s\n", report.name.c_str(), outcome_name(report));
    } else {
      print_trial(report.name, report.best, i == choice.candidate ? "taken" : outcome_name(report));
    }
  }
  for (const CodingTrial& trial : choice.coarser_and_finer)
    print_trial(coding.codec, trial, trial.crf > choice.trial.crf ? "coarser" : "finer");
}

void print_summary(const BakeSummary& s) {
  std::fprintf(stderr, "%s: %s, %llu frames, order %d, %dx%d; %s, %d charts, %.0f %% covered\n",
               s.output.c_str(), s.clip.c_str(), static_cast<unsigned long long>(s.frames), s.order,
               s.width, s.height,
               s.atlas.set < 0 ? "unwrapped" : ("UV set " + std::to_string(s.atlas.set)).c_str(),
               s.atlas.charts, 100 * s.atlas.coverage);
  if (s.choice) print_choice(*s.choice, s.coding);
  std::fprintf(
      stderr, "%llu bytes: light %llu, pose %llu, meshes %llu, images %llu\n",
      static_cast<unsigned long long>(s.bytes), static_cast<unsigned long long>(s.video_bytes),
      static_cast<unsigned long long>(s.pose_bytes), static_cast<unsigned long long>(s.mesh_bytes),
      static_cast<unsigned long long>(s.image_bytes));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Bakes an animated glTF character into a relightable .relit file.", "relit-bake");
  app.footer(kExamples);
  app.set_version_flag("--version", "relit-bake " RELIT_VERSION);
  Arguments arguments;
  add_options(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error, std::cout, std::cerr) == 0 ? 0 : kUsage;
  }
  if (arguments.list_clips) return list_clips(arguments.bake.input);
  if (arguments.bake.output.empty()) {
    return report({ErrorCode::kInvalid, "no output named: relit-bake IN.glb OUT.relit"});
  }
  if (const Status status = complete(arguments, app); !status) return report(status.error());
  Progress progress(arguments.quiet);
  const Result<std::vector<BakeSummary>> summaries = bake::bake(arguments.bake, progress);
  if (!summaries) return report(summaries.error());
  for (const std::string& warning : summaries->front().warnings)
    std::fprintf(stderr, "relit-bake: warning: %s\n", warning.c_str());
  for (const BakeSummary& summary : *summaries)
    if (!arguments.quiet) print_summary(summary);
  if (arguments.json) print_json(*summaries, arguments.bake);
  return 0;
}
