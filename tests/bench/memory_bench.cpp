// SPDX-License-Identifier: MIT
// memory_bench FILE BUDGET: plays a clip once within its memory plan, the ring of decoded frames
// full from the first to the last, composited on the CPU, for a heap profiler to watch. Prints the
// plan's account of the heap in bytes, or "refused BYTES" with the smallest budget that would do.
#include <algorithm>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "decoders/composite.hpp"
#include "player/clip_demuxer.hpp"
#include "player/memory_plan.hpp"
#include "player/prefetcher.hpp"
#include "player/relighter.hpp"

using namespace relit;
using namespace relit::player;

namespace {

struct Facts {
  container::FileContents contents;
  SegmentScale segments;
};

Result<Facts> look_at(const std::string& path) {
  RELIT_ASSIGN(auto source, container::FileSource::open(path));
  RELIT_ASSIGN(auto reader, container::Reader::open(std::move(source)));
  Facts facts;
  RELIT_ASSIGN(facts.contents, container::load_static(reader));
  RELIT_ASSIGN(facts.segments, largest_segment(reader, facts.contents.clips.front()));
  return facts;
}

// The plan, or nothing where it is refused, which is said.
Result<std::optional<MemoryPlan>> make_plan(const std::string& path, std::uint64_t budget) {
  MemoryWishes wishes;
  RELIT_ASSIGN(const Facts facts, look_at(path));
  auto plan = plan_memory(facts.contents, facts.segments, wishes, budget);
  if (plan) return std::optional(std::move(*plan));
  if (plan.error().code != ErrorCode::kOutOfMemory) return Unexpected{plan.error()};
  RELIT_ASSIGN(const std::uint64_t smallest,
               smallest_budget(facts.contents, facts.segments, wishes));
  std::printf("refused %llu\n", static_cast<unsigned long long>(smallest));
  return std::optional<MemoryPlan>();
}

decoders::Light white() {
  decoders::Light light;
  light.sh = {{1, 1, 1}, {0.3, 0.2, 0.1}, {0.2, 0.2, 0.2}, {0.1, 0.2, 0.3}};
  return light;
}

Status play(const std::string& path, std::uint64_t budget) {
  RELIT_ASSIGN(const std::optional<MemoryPlan> plan, make_plan(path, budget));
  if (!plan) return {};
  RELIT_ASSIGN(auto source, container::FileSource::open(path));
  RELIT_ASSIGN(ClipDemuxer demuxer, ClipDemuxer::open(std::move(source), path, {}));
  RELIT_ASSIGN(auto pool, WorkerPool::create(plan->threads));
  PrefetchOptions options;
  options.ring_bytes = plan->ring_bytes;
  options.packet_bytes = plan->packet_bytes;
  options.threads = plan->decoder_threads;
  options.layers = plan->layers;
  options.impatient = false;
  RELIT_ASSIGN(auto clip, Prefetcher::create(std::move(demuxer), pool, options));
  RELIT_ASSIGN(auto relighter, Relighter::create(clip->model(), clip->layers(), {}));
  RELIT_TRY(relighter->set_light(white(), plan->layers));
  for (std::uint64_t k = 0; k < clip->clip().frame_count; ++k) {
    clip->want(k);
    RELIT_ASSIGN(bool come, clip->wait(k, 600));
    const ClipFrame* frame = come ? clip->frame(k) : nullptr;
    // The ring has room for so many, this one included.
    const std::uint64_t last = std::min(k + plan->ring_frames, clip->clip().frame_count) - 1;
    if (frame == nullptr) return fail(ErrorCode::kCorrupt, "a frame has not come");
    // The ring fills once, and from then on lacks one frame, the last, at most.
    if (const std::uint64_t behind = k == 0 ? 0 : 1; last - behind > k) {
      RELIT_ASSIGN(come, clip->wait(last - behind, 60));
      if (!come) {
        const PrefetchStats stats = clip->stats();
        std::fprintf(stderr, "memory_bench: %zu frames, %zu of %llu bytes, are ahead\n",
                     stats.ring_frames, stats.ring_bytes,
                     static_cast<unsigned long long>(plan->ring_bytes));
      }
    }
    RELIT_TRY(relighter->composite({&frame->planes, nullptr, 0}));
  }
  std::printf("%llu heap, %llu frames ahead, %d of %zu layers\n",
              static_cast<unsigned long long>(plan->heap_bytes()),
              static_cast<unsigned long long>(plan->ring_frames), plan->layer_count(),
              plan->layers.size());
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const auto budget = parse_bytes(argv[2]);
  if (!budget) return 2;
  const Status played = play(argv[1], *budget);
  if (!played) std::fprintf(stderr, "memory_bench: %s\n", played.error().message.c_str());
  return played ? 0 : 1;
}
