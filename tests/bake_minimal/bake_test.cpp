// SPDX-License-Identifier: MIT
// The baker as a whole: files and what they hold, determinism, and everything that can go wrong.
#include "bake_minimal/bake.hpp"

#include <sys/wait.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <numbers>

#include "bake_minimal/plane_layout.hpp"
#include "container/byte_source.hpp"
#include "container/reader.hpp"
#include "decoders/npy.hpp"
#include "decoders/plane_decoder.hpp"
#include "decoders/sh.hpp"
#include "tests/places.hpp"

using namespace relit;
using namespace relit::bake;
namespace fs = std::filesystem;

namespace {

struct Folder {
  fs::path path;
  Folder() {
    std::string name = (fs::temp_directory_path() / "relit-bake-test-XXXXXX").string();
    path = ::mkdtemp(name.data());
  }
  ~Folder() { fs::remove_all(path); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
};

fs::path mannequin() { return test::binary_dir() / "media/mannequin.glb"; }

BakeOptions small_bake(const Folder& folder, const std::string& name) {
  BakeOptions options;
  options.input = mannequin();
  options.output = folder.path / name;
  options.max_frames = 3;
  options.transfer.directions = 64;
  options.transfer.width = options.transfer.height = 64;
  options.coding.preset = "ultrafast";
  return options;
}

BakeSummary must_bake(const BakeOptions& options) {
  Progress quiet(true);
  auto summary = bake::bake(options, quiet);
  if (!summary) FAIL(summary.error().message);
  REQUIRE(summary->size() == 1);
  return summary->front();
}

std::string bytes_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// All transfer of a file, [frames][coefficients][3][H][W], and its records.
struct Decoded {
  container::FileContents contents;
  std::vector<float> transfer;
};

Decoded decode(const fs::path& path) {
  auto source = container::FileSource::open(path.string());
  REQUIRE(source);
  auto reader = container::Reader::open(std::move(*source));
  REQUIRE(reader);
  auto contents = container::load_static(*reader);
  REQUIRE(contents);
  const container::ModelRecord& model = contents->models.front();
  const auto layers = contents->layers_of(model.id);
  auto planes = decoders::PlaneDecoder::open(model, layers);
  REQUIRE(planes);
  container::SegmentRecord segment;
  for (;;) {
    auto record = reader->next();
    REQUIRE(record);
    if (!*record) break;
    if (auto* s = std::get_if<container::SegmentRecord>(&(*record)->body)) segment = *s;
    if (auto* c = std::get_if<container::ChunkRecord>(&(*record)->body))
      REQUIRE(planes->add_chunk(segment, std::move(*c)));
  }
  Decoded out;
  const std::size_t frame_size =
      std::size_t{3} * static_cast<std::size_t>(decoders::coefficient_count(model.order)) *
      model.width * model.height;
  for (std::uint64_t k = 0; k < contents->clips.front().frame_count; ++k) {
    auto view = planes->frame(k);
    REQUIRE(view);
    std::vector<float> frame(frame_size);
    REQUIRE(decoders::reconstruct(view->planes(), model, layers, frame));
    out.transfer.insert(out.transfer.end(), frame.begin(), frame.end());
  }
  out.contents = std::move(*contents);
  return out;
}

}  // namespace

TEST_CASE("a bake is the same bytes for any number of threads, and other bytes for another seed") {
  const Folder folder;
  BakeOptions one = small_bake(folder, "one.relit"), five = small_bake(folder, "five.relit"),
              seed = small_bake(folder, "seed.relit");
  one.transfer.threads = 1, five.transfer.threads = 5, seed.transfer.seed = 1;
  must_bake(one), must_bake(five), must_bake(seed);
  CHECK(bytes_of(one.output) == bytes_of(five.output));
  CHECK(bytes_of(one.output) != bytes_of(seed.output));
}

TEST_CASE("a lossless file holds the reference to within the quantiser's bound") {
  for (const int bit_depth : {8, 10}) {
    const Folder folder;
    BakeOptions options = small_bake(folder, "lossless.relit");
    options.coding.lossless = true;
    options.coding.bit_depth = bit_depth;
    options.reference = folder.path / "reference.npy";
    must_bake(options);
    const auto reference = decoders::read_npy(options.reference);
    REQUIRE(reference);
    const Decoded file = decode(options.output);
    REQUIRE(reference->values.size() == file.transfer.size());
    const auto layers = file.contents.layers_of(file.contents.models.front().id);
    const std::size_t texels = 64 * 64;
    double worst = 0;
    for (std::size_t i = 0; i < file.transfer.size(); ++i) {
      const int n = static_cast<int>(i / (3 * texels) % 9), c = static_cast<int>(i / texels % 3);
      // Beyond half a step: the rounding of the reference, of the mean and of the sum to float.
      const double bound = quantiser_bound(layers, n, c) + 4 * 6e-8;
      worst = std::max(worst, std::abs(static_cast<double>(file.transfer[i]) -
                                       static_cast<double>(reference->values[i])) /
                                  bound);
    }
    INFO("bit depth " << bit_depth);
    CHECK(worst <= 1);
    CHECK(worst > 0.5);  // a bound that is never approached would prove nothing
  }
}

TEST_CASE("a sweep codes one trace in several ways, each as it would be by itself", "[long]") {
  const Folder folder;
  BakeOptions options = small_bake(folder, "sweep.relit");
  options.reference = folder.path / "reference.npy";
  auto variants = expand_sweep("planes=colour,principal crf=20,30", options.coding);
  REQUIRE(variants);
  options.sweep = *variants;
  Progress quiet(true);
  const auto summaries = bake::bake(options, quiet);
  if (!summaries) FAIL(summaries.error().message);
  REQUIRE(summaries->size() == 4);
  CHECK(fs::exists(options.reference));
  CHECK_FALSE(fs::exists(options.output));
  for (std::size_t i = 0; i < 4; ++i) {
    const BakeSummary& summary = (*summaries)[i];
    INFO(summary.output.string());
    CHECK(summary.output.filename() == "sweep-" + (*variants)[i].name + ".relit");
    CHECK(summary.bytes == fs::file_size(summary.output));
    BakeOptions single = small_bake(folder, "single.relit");
    single.coding = (*variants)[i].coding;
    single.write_normals = true;  // as the sweep does for the sake of the others
    must_bake(single);
    CHECK(bytes_of(single.output) == bytes_of(summary.output));
  }
  CHECK((*summaries)[0].video_bytes > (*summaries)[1].video_bytes);
}

TEST_CASE("a target is met by the file that is written, as its dump is measured", "[long]") {
  const Folder folder;
  for (const double target : {34.0, 41.0}) {
    BakeOptions options = small_bake(folder, "target.relit");
    options.reference = folder.path / "reference.npy";
    options.goal = Goal{Goal::Kind::kPsnr, target};
    const BakeSummary summary = must_bake(options);
    REQUIRE(summary.choice);
    CHECK(summary.choice->trial.figures.psnr_db >= target);
    // Of three small frames by the fastest preset, a step of the factor moves up to 0.6 dB.
    CHECK(summary.choice->trial.figures.psnr_db <= target + 0.75);
    // A file that was baked with that factor is the same.
    BakeOptions single = small_bake(folder, "single.relit");
    single.coding.crf = summary.coding.crf;
    CHECK_FALSE(must_bake(single).choice);
    CHECK(bytes_of(single.output) == bytes_of(options.output));
  }
  BakeOptions options = small_bake(folder, "target.relit");
  options.goal = Goal{Goal::Kind::kPsnr, 90};
  Progress quiet(true);
  const auto beyond = bake::bake(options, quiet);
  REQUIRE(!beyond);
  CHECK(beyond.error().message.find("out of reach") != std::string::npos);
  options.coding.lossless = true;
  CHECK_FALSE(bake::bake(options, quiet));
}

TEST_CASE("of every second frame a file holds half, at half the rate") {
  const Folder folder;
  BakeOptions options = small_bake(folder, "half.relit");
  options.max_frames = 6;
  options.reference = folder.path / "reference.npy";
  options.coding.frame_step = 2, options.coding.lossless = true;
  const BakeSummary summary = must_bake(options);
  CHECK(summary.frames == 3);
  CHECK(summary.frame_rate == container::Rational{25, 1});
  const Decoded file = decode(options.output);
  CHECK(file.contents.clips.front().tick_rate == container::Rational{25, 1});
  CHECK(file.contents.clips.front().frame_count == 3);
  const auto reference = decoders::read_npy(options.reference);
  REQUIRE(reference);
  const std::size_t plane = 64 * 64, frame = 27 * plane;
  REQUIRE(reference->values.size() == 6 * frame);
  double worst = 0;
  for (std::size_t i = 0; i < file.transfer.size(); ++i) {
    const std::size_t k = i / frame, p = i % frame / plane;
    const double bound =
        quantiser_bound(file.contents.layers, static_cast<int>(p / 3), static_cast<int>(p % 3), 0);
    const float truth = reference->values[2 * k * frame + i % frame];
    worst = std::max(worst, std::abs(static_cast<double>(file.transfer[i] - truth)) / bound);
  }
  // The bound, and what single precision adds to it.
  CHECK(worst <= 1.001);
  CHECK(worst > 0.5);
  options.coding.frame_step = 4;
  Progress quiet(true);
  const auto odd = bake::bake(options, quiet);
  REQUIRE(!odd);
  CHECK(odd.error().message.find("must divide the clip's 6 frames") != std::string::npos);
}

TEST_CASE("what a target says of blended frames is what they are", "[long]") {
  const Folder folder;
  BakeOptions options = small_bake(folder, "blended.relit");
  options.max_frames = 6;
  options.reference = folder.path / "reference.npy";
  options.coding.frame_step = 2, options.coding.planes = Planes::kColour;
  options.goal = Goal{Goal::Kind::kPsnr, 32};
  const BakeSummary summary = must_bake(options);
  REQUIRE(summary.choice);
  const auto reference = decoders::read_npy(options.reference);
  REQUIRE(reference);
  const Decoded file = decode(options.output);
  const std::size_t frame = file.transfer.size() / 3;
  REQUIRE(reference->values.size() == 6 * frame);
  BakeOptions prepared_options = options;
  const auto prepared = prepare_bake(prepared_options);
  REQUIRE(prepared);
  std::vector<std::uint8_t> covered(64 * 64, 0);
  for (const TexelSample& sample : prepared->samples) covered[sample.texel] = sample.covered;
  decoders::RelitError error(decoders::standard_lights(), 9, covered);
  std::vector<float> shown(frame);
  for (std::size_t k = 0; k < 6; ++k) {
    // The clip loops: the last frame is blended into the first.
    const std::size_t from = k / 2, to = (from + k % 2) % 3;
    for (std::size_t v = 0; v < frame; ++v)
      shown[v] = (file.transfer[from * frame + v] + file.transfer[to * frame + v]) / 2;
    error.add_frame(std::span(reference->values).subspan(k * frame, frame), shown);
  }
  // Sums of floats in another order.
  CHECK(error.figures().psnr_db == Approx(summary.choice->trial.figures.psnr_db).margin(1e-3));
}

TEST_CASE("T_0 of every texel and frame is physical") {
  const Folder folder;
  BakeOptions options = small_bake(folder, "bounds.relit");
  options.transfer.directions = 1024, options.transfer.bounces = 3;
  const BakeSummary summary = must_bake(options);
  // The lattice of 1024 directions errs by less than 0.5 % on an open hemisphere.
  CHECK(summary.least_t0 >= 0);
  CHECK(summary.largest_t0 <= 0.28209479f * 1.005f);
  CHECK(summary.largest_t0 > 0.25f);
}

TEST_CASE("the paper's preset is a grid of MPEG-4 mantissas with an exponent for every texel") {
  const Folder folder;
  BakeOptions options = small_bake(folder, "paper.relit");
  options.coding = paper_options();
  must_bake(options);
  const Decoded file = decode(options.output);
  REQUIRE(file.contents.layers.size() == 1);
  const container::LayerRecord& layer = file.contents.layers.front();
  CHECK(layer.codec == "mpeg4");
  CHECK(layer.exponent_codec == "ffv1");
  CHECK(layer.exponent_block == 1);
  CHECK(layer.planes.size() == 27);
  CHECK(layer.coded_width == 192);
  CHECK(layer.planes[3 * 5].mantissa_rect.x == 128);
  CHECK(layer.planes[3 * 5].mantissa_rect.y == 64);
}

TEST_CASE("what cannot be written is said before tracing, and nothing is left behind") {
  const Folder folder;
  BakeOptions options = small_bake(folder, "no/such/folder.relit");
  Progress quiet(true);
  const auto missing = bake::bake(options, quiet);
  REQUIRE_FALSE(missing);
  CHECK(missing.error().message.find("no/such") != std::string::npos);
  options = small_bake(folder, "out.relit");
  options.input = folder.path / "absent.glb";
  const auto absent = bake::bake(options, quiet);
  REQUIRE_FALSE(absent);
  CHECK(absent.error().message.find("absent.glb") != std::string::npos);
  std::ofstream(folder.path / "bad.glb") << "not a glTF";
  options.input = folder.path / "bad.glb";
  CHECK_FALSE(bake::bake(options, quiet));
  CHECK_FALSE(fs::exists(options.output));
  CHECK(std::distance(fs::directory_iterator(folder.path), fs::directory_iterator()) == 1);
}

TEST_CASE("options that make no sense are refused with what would be right") {
  const Folder folder;
  Progress quiet(true);
  const auto message = [&](const std::function<void(BakeOptions&)>& change) {
    BakeOptions options = small_bake(folder, "x.relit");
    change(options);
    const auto result = bake::bake(options, quiet);
    REQUIRE_FALSE(result);
    CHECK(result.error().code == ErrorCode::kInvalid);
    return result.error().message;
  };
  CHECK(message([](BakeOptions& o) { o.transfer.order = 7; }).find("0 to 3") != std::string::npos);
  CHECK(message([](BakeOptions& o) { o.transfer.width = 0; }).find("1 to 4096") !=
        std::string::npos);
  CHECK(message([](BakeOptions& o) { o.segment_s = 0; }).find("--segment") != std::string::npos);
  CHECK_FALSE(
      message([](BakeOptions& o) { o.coding.codec = "mpeg4", o.coding.bit_depth = 10; }).empty());
}

TEST_CASE("frames lie at k / fps below the duration") {
  CHECK(frame_count(2.0, {50, 1}) == 100);
  CHECK(frame_count(2.0000001, {50, 1}) == 100);
  CHECK(frame_count(2.01, {50, 1}) == 101);
  CHECK(frame_count(0, {50, 1}) == 1);
  CHECK(frame_count(1.0, {30000, 1001}) == 30);
}

TEST_CASE("the command's exit status is 1 for bad input and 2 for bad usage") {
  const Folder folder;
  const std::string command = (test::binary_dir() / "bin/relit-bake").string();
  const auto status = [&](const std::string& arguments) {
    return WEXITSTATUS(std::system((command + " " + arguments + " >/dev/null 2>&1").c_str()));
  };
  CHECK(status("--help") == 0);
  CHECK(status("") == 2);
  CHECK(status("--no-such-option") == 2);
  CHECK(status((folder.path / "absent.glb").string() + " " + (folder.path / "o.relit").string()) ==
        1);
  CHECK(status(mannequin().string() + " " + (folder.path / "o.relit").string() +
               " --fps nonsense") == 2);
  CHECK(status(mannequin().string() + " --list-clips") == 0);
  CHECK(status(mannequin().string() + " /dev/full --max-frames 1 --samples 8 --size 32") == 1);
}
