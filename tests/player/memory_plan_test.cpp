// SPDX-License-Identifier: MIT
#include "player/memory_plan.hpp"

#include <algorithm>
#include <functional>

#include "gles/character_renderer.hpp"
#include "gles/picture.hpp"
#include "player/gl_backend.hpp"
#include "player/relighter.hpp"
#include "tests/test.hpp"

using namespace relit;
using namespace relit::player;
using container::FileContents;
using container::LayerRecord;

namespace {

constexpr int kSide = 64;

/// Three layers of 1, 3 and 5 coefficients in 4:2:0, and a mesh.
FileContents contents() {
  FileContents file;
  file.clips.resize(1);
  file.clips[0].name = "walk";
  file.clips[0].frame_count = file.clips[0].duration_ticks = 100;
  file.models.resize(1);
  file.models[0].width = file.models[0].height = kSide;
  file.models[0].mean.resize(9);
  file.pose_tracks.resize(1);
  file.skeleton.nodes.resize(19);
  file.skeleton.palette.resize(19);
  container::MeshRecord mesh;
  mesh.vertex_count = 3000, mesh.index_count = 9000;
  mesh.streams.resize(2);
  mesh.streams[1].semantic = container::Semantic::kLightMapUv;
  file.meshes.push_back(mesh);
  std::uint8_t coefficient = 0;
  for (int tiles = 1; tiles <= 5; tiles += 2) {
    LayerRecord layer;
    layer.id = layer.mantissa_track = static_cast<std::uint32_t>(tiles);
    layer.codec = "h264";
    layer.coded_width = static_cast<std::uint16_t>(tiles * kSide), layer.coded_height = kSide;
    layer.mantissa_pictures = 4;
    for (int t = 0; t < tiles; ++t, ++coefficient) {
      for (std::uint8_t c = 0; c < 3; ++c) {
        container::PlaneRecord plane;
        plane.component = c;
        plane.mantissa_rect = {static_cast<std::uint16_t>(t * kSide), 0, kSide, kSide};
        plane.matrix = {{coefficient, c, 1.0f}};
        layer.planes.push_back(plane);
      }
    }
    file.layers.push_back(layer);
  }
  return file;
}

MemoryWishes drawn() {
  MemoryWishes wishes;
  wishes.threads = 12;
  wishes.drawing.emplace();
  return wishes;
}

constexpr SegmentScale kSegments{25, 40000};

std::uint64_t least(const FileContents& file, const MemoryWishes& wishes) {
  const auto bytes = smallest_budget(file, kSegments, wishes);
  REQUIRE(bytes);
  return *bytes;
}

MemoryPlan plan(const FileContents& file, const MemoryWishes& wishes,
                std::optional<std::uint64_t> budget = {}) {
  auto made = plan_memory(file, kSegments, wishes, budget);
  INFO((made ? "" : made.error().message));
  REQUIRE(made);
  return *made;
}

/// What a plan keeps of what can be given up, the dearest first.
std::array<std::uint64_t, 5> kept(const MemoryPlan& p) {
  return {static_cast<std::uint64_t>(p.layer_count()),
          p.light_map == gles::LightMapFormat::kSquareRoot8 ? 0u : 1u,
          p.path == CompositePath::kAuto ? 1u : 0u, static_cast<std::uint64_t>(p.threads),
          p.ring_frames};
}

const MemoryTerm& term(const MemoryPlan& p, const std::string& name) {
  const auto found = std::find_if(p.terms.begin(), p.terms.end(),
                                  [&](const MemoryTerm& t) { return t.name == name; });
  REQUIRE(found != p.terms.end());
  return *found;
}

}  // namespace

TEST_CASE("a memory plan grants every wish where nothing bounds it") {
  const FileContents file = contents();
  const MemoryPlan p = plan(file, drawn());
  CHECK(p.ring_frames == 12);  // a quarter of a second at 50 frames/s
  CHECK(p.threads == 12);
  CHECK(p.layers == std::vector<std::uint8_t>{1, 1, 1});
  CHECK(p.path == CompositePath::kAuto);
  CHECK(p.light_map == gles::LightMapFormat::kHalfFloat);
  CHECK(p.given_up.empty());
  // More than any machine has is no reason to take more.
  CHECK(plan(file, drawn(), std::uint64_t{1} << 62).total_bytes() == p.total_bytes());
  CHECK(plan(file, drawn(), p.total_bytes()).given_up.empty());
}

TEST_CASE("a memory plan gives things up in the order that it states") {
  const FileContents file = contents();
  const std::uint64_t low = least(file, drawn());
  const std::uint64_t high = plan(file, drawn()).total_bytes();
  const std::array<std::uint64_t, 5> all = kept(plan(file, drawn()));
  auto before = kept(plan(file, drawn(), low));
  CHECK(before == std::array<std::uint64_t, 5>{1, 0, 0, 1, 2});
  for (int step = 0; step <= 400; ++step) {
    const std::uint64_t budget = low + (high - low) * static_cast<std::uint64_t>(step) / 400;
    const MemoryPlan p = plan(file, drawn(), budget);
    INFO(budget);
    CHECK(p.total_bytes() <= budget);
    // More memory never loses what is dearer, whatever happens to what is cheaper.
    const auto now = kept(p);
    CHECK(now >= before);
    before = now;
    const bool less = now != all;
    CHECK(p.given_up.empty() != less);
  }
  CHECK(before == all);
}

TEST_CASE("nothing dearer is given up where something cheaper would do") {
  const FileContents file = contents();
  const MemoryPlan all = plan(file, drawn());
  const MemoryPlan tight = plan(file, drawn(), all.total_bytes() - 1);
  CHECK(tight.ring_frames == all.ring_frames - 1);
  CHECK(tight.threads == all.threads);
  CHECK(tight.given_up.size() == 1);
  MemoryWishes shortest = drawn();
  shortest.ring_frames = 2;
  const std::uint64_t with_threads = plan(file, shortest).total_bytes();
  const MemoryPlan slower = plan(file, drawn(), with_threads - 1);
  CHECK(slower.threads < 12);
  CHECK(slower.path == CompositePath::kAuto);
  CHECK(slower.layer_count() == 3);
}

TEST_CASE("a refused budget is told the smallest that would do, and that one does") {
  const FileContents file = contents();
  for (const bool headless : {false, true}) {
    MemoryWishes wishes = drawn();
    if (headless) wishes.drawing.reset();
    const std::uint64_t needed = least(file, wishes);
    for (const std::uint64_t budget : {std::uint64_t{0}, std::uint64_t{1024}, needed - 1}) {
      const auto refused = plan_memory(file, kSegments, wishes, budget);
      REQUIRE_FALSE(refused);
      CHECK(refused.error().code == ErrorCode::kOutOfMemory);
      CHECK(refused.error().message.find(std::to_string(needed)) != std::string::npos);
      CHECK(refused.error().message.find("does not suffice") != std::string::npos);
    }
    CHECK(plan(file, wishes, needed).total_bytes() == needed);
  }
}

TEST_CASE("a memory plan's totals are the sums of its terms") {
  const FileContents file = contents();
  const MemoryPlan p = plan(file, drawn());
  std::uint64_t heap = 0, gpu = 0;
  for (const MemoryTerm& t : p.terms) {
    heap += t.heap_bytes, gpu += t.gpu_bytes;
    CHECK(t.heap_bytes + t.gpu_bytes > 0);
    CHECK_FALSE(t.what.empty());
    CHECK(std::count_if(p.terms.begin(), p.terms.end(),
                        [&](const MemoryTerm& o) { return o.name == t.name; }) == 1);
  }
  CHECK(p.heap_bytes() == heap);
  CHECK(p.gpu_bytes() == gpu);
  CHECK(term(p, "ring").heap_bytes == p.ring_bytes);
  CHECK(p.ring_bytes == p.ring_frames * p.frame_bytes);
  MemoryWishes headless;
  CHECK(plan(file, headless).gpu_bytes() == 0);
}

TEST_CASE("a memory plan takes what the clip needs and no more") {
  FileContents file = contents();
  MemoryWishes wishes;
  wishes.layers = 2;
  CHECK(plan(file, wishes).layers == std::vector<std::uint8_t>{1, 1, 0});
  wishes.layers = 99;
  CHECK(plan(file, wishes).layer_count() == 3);
  wishes.ring_frames = 1000000;
  CHECK(plan(file, wishes).ring_frames == 100);
  file.clips[0].frame_count = file.clips[0].duration_ticks = 1;
  CHECK(plan(file, wishes).ring_frames == 2);
  for (const auto& spoil : std::vector<std::function<void(MemoryWishes&)>>{
           [](MemoryWishes& w) { w.threads = 0; }, [](MemoryWishes& w) { w.threads = 65; },
           [](MemoryWishes& w) { w.ring_frames = 1; }, [](MemoryWishes& w) { w.layers = 0; }}) {
    MemoryWishes wrong;
    spoil(wrong);
    const auto made = plan_memory(file, kSegments, wrong, {});
    REQUIRE_FALSE(made);
    CHECK(made.error().code == ErrorCode::kInvalid);
  }
  wishes.clip = "run";
  const auto missing = plan_memory(file, kSegments, wishes, {});
  REQUIRE_FALSE(missing);
  CHECK(missing.error().code == ErrorCode::kNotFound);
}

TEST_CASE("more reference pictures, bits and threads take more memory") {
  FileContents file = contents();
  MemoryWishes wishes;
  const std::uint64_t before = plan(file, wishes).total_bytes();
  const MemoryPlan one = plan(file, wishes);
  wishes.threads = 8;
  const MemoryPlan eight = plan(file, wishes);
  CHECK(term(eight, "decoders").heap_bytes > term(one, "decoders").heap_bytes);
  CHECK(term(eight, "references").heap_bytes > term(one, "references").heap_bytes);
  wishes.threads = 1;
  for (LayerRecord& layer : file.layers) layer.mantissa_pictures = 5;
  const std::uint64_t more = plan(file, wishes).total_bytes();
  CHECK(more > before);
  for (LayerRecord& layer : file.layers) layer.bit_depth = 10;
  CHECK(plan(file, wishes).total_bytes() > more);
}

// The account is made by formulas; what GL objects report is what they have allocated.
TEST_CASE("the memory plan's terms are what the relighter and the framebuffer report") {
  auto backend = open_backend(Backend::kEgl);
  REQUIRE(backend);
  const gles::Device& device = *backend->device;
  const FileContents file = contents();
  for (const CompositePath path : {CompositePath::kCpu, CompositePath::kTexture}) {
    for (const auto format :
         {gles::LightMapFormat::kHalfFloat, gles::LightMapFormat::kSquareRoot8}) {
      MemoryWishes wishes = drawn();
      wishes.path = path, wishes.light_map = format;
      wishes.drawing->max_texture_size = device.caps().max_texture_size;
      wishes.drawing->framebuffer_width = 320, wishes.drawing->framebuffer_height = 200;
      wishes.drawing->samples = 4;
      const MemoryPlan p = plan(file, wishes);
      const auto relighter =
          Relighter::create(file.models[0], file.layers, {&device, path, format});
      REQUIRE(relighter);
      std::uint64_t heap = 0, gpu = 0;
      for (const MemoryTerm& t : p.terms) {
        if (t.name != "cpu composite" && t.name != "plane textures" && t.name != "light map")
          continue;
        heap += t.heap_bytes, gpu += t.gpu_bytes;
      }
      INFO(composite_path_name(path));
      CHECK(gpu == (*relighter)->gpu_bytes());
      // Beside it the relighter counts the weights' uniforms: some floats for each of 27 planes.
      CHECK(heap <= (*relighter)->cpu_bytes());
      CHECK((*relighter)->cpu_bytes() - heap < 27 * 16 * sizeof(float));
      gles::FramebufferOptions size;
      size.width = 320, size.height = 200, size.samples = 4;
      const auto framebuffer = gles::Framebuffer::create(device, size);
      REQUIRE(framebuffer);
      CHECK(term(p, "framebuffer").gpu_bytes == framebuffer->gpu_bytes());
    }
  }
}

TEST_CASE("numbers of bytes are read with their units") {
  const std::vector<std::pair<std::string, std::uint64_t>> good{{"0", 0},
                                                                {"1024", 1024},
                                                                {"8MiB", 8u << 20},
                                                                {"64M", 64u << 20},
                                                                {"1.5k", 1536},
                                                                {"512KiB", 512u << 10},
                                                                {"2GiB", std::uint64_t{2} << 30},
                                                                {"7B", 7}};
  for (const auto& [text, bytes] : good) {
    const auto read = parse_bytes(text);
    INFO(text);
    REQUIRE(read);
    CHECK(*read == bytes);
  }
  for (const char* text :
       {"", "-1", "MiB", "8 MiB", "8MB2", "nan", "inf", "1e400", "9999999999G"}) {
    const auto read = parse_bytes(text);
    INFO(text);
    REQUIRE_FALSE(read);
    CHECK(read.error().code == ErrorCode::kInvalid);
  }
}

TEST_CASE("a memory plan of a sequence counts the two clips that take most") {
  FileContents file = contents();
  // A second clip, whose light map and pictures are twice as wide, and a third one like the first.
  file.clips.push_back(file.clips[0]);
  file.clips[1].id = 1, file.clips[1].name = "run";
  file.models.push_back(file.models[0]);
  file.models[1].id = file.models[1].clip_id = 1;
  file.models[1].width = 2 * kSide;
  file.pose_tracks.push_back(file.pose_tracks[0]);
  file.pose_tracks[1].clip_id = 1;
  for (std::size_t l = 0; l < 3; ++l) {
    LayerRecord layer = file.layers[l];
    layer.model_id = 1;
    layer.coded_width = static_cast<std::uint16_t>(2 * layer.coded_width);
    for (container::PlaneRecord& plane : layer.planes) {
      plane.mantissa_rect.x = static_cast<std::uint16_t>(2 * plane.mantissa_rect.x);
      plane.mantissa_rect.width = 2 * kSide;
    }
    file.layers.push_back(layer);
  }
  MemoryWishes walk = drawn(), run = drawn(), both = drawn(), thrice = drawn();
  walk.clip = both.clip = thrice.clip = "walk";
  run.clip = "run";
  both.others = {"run"};
  thrice.others = {"walk", "run", "walk"};
  const auto bytes = [&](const MemoryWishes& wishes) { return plan(file, wishes).total_bytes(); };
  const MemoryPlan p = plan(file, both);
  CHECK(term(p, "second clip").heap_bytes > 0);
  CHECK(term(p, "cross-fade").heap_bytes == 3 * sizeof(float) * 2 * kSide * kSide);
  // Each alone counts what they share: program, records, meshes.
  CHECK(bytes(both) < bytes(walk) + bytes(run));
  CHECK(bytes(both) > bytes(run) + term(plan(file, walk), "ring").heap_bytes);
  CHECK(bytes(thrice) == bytes(both));  // more are never in memory
  // One that comes after itself is there twice.
  MemoryWishes again = walk;
  again.others = {"walk"};
  CHECK(bytes(again) > bytes(walk));
  CHECK(bytes(again) < bytes(both));
  // The ring is that of the larger pictures, whichever clip it is.
  CHECK(p.frame_bytes == plan(file, run).frame_bytes);
  CHECK(plan(file, both, bytes(both) - 1).total_bytes() < bytes(both));
  const auto least_of_both = smallest_budget(file, kSegments, both);
  REQUIRE(least_of_both);
  CHECK(*least_of_both > least(file, run));
  CHECK(plan_memory(file, kSegments, both, *least_of_both));
  CHECK(plan_memory(file, kSegments, both, *least_of_both - 1).error().code ==
        ErrorCode::kOutOfMemory);
  both.others = {"swim"};
  CHECK(plan_memory(file, kSegments, both, {}).error().code == ErrorCode::kNotFound);
}
