// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "container/reader.hpp"
#include "gles/plane_set.hpp"
#include "player/path_chooser.hpp"

/// What playing a clip will take, before anything large is allocated (design, section 5).
namespace relit::player {

/// The largest segment of a clip. Zeros: unknown, as of a source that cannot seek.
struct SegmentScale {
  std::uint64_t frames = 0;
  std::uint64_t bytes = 0;  ///< its record and all its chunks
};

/// From a file's index, and the last segment's own record; zeros where the source cannot seek or
/// has no index. The reader then stands inside that segment: it serves nothing else, or seeks.
/// Errors: those of the source, and of a damaged last segment.
[[nodiscard]] Result<SegmentScale> largest_segment(container::Reader& reader,
                                                   const container::ClipRecord& clip);

/// The picture that the character is drawn into, and what is behind it.
struct DrawingScale {
  int max_texture_size = 4096;
  int framebuffer_width = 0;  ///< 0: the host's own, which counts as nothing here
  int framebuffer_height = 0;
  int samples = 1;          ///< gles::FramebufferOptions::samples
  int background_side = 0;  ///< of the environment's cube map, texels; 0: none
};

/// What the caller would like. A plan grants as much of it as fits the budget, and never more.
struct MemoryWishes {
  std::string clip;  ///< by name or number; empty: the first
  /// The other clips of a sequence, as `clip`; one that comes twice is named twice. Two clips have
  /// decoders, frames and a light map at once: those of a cross-fade, or one and the next. The plan
  /// counts the two that take most, and grants both the same.
  std::vector<std::string> others;
  int layers = -1;                ///< the first so many; -1: all
  int threads = 1;                ///< decode workers, 1 to 64
  std::uint64_t ring_frames = 0;  ///< decoded ahead; 0: a quarter of a second, 4 to 16. At least 2
  std::optional<DrawingScale> drawing;        ///< none: no GL, as `relit stream`
  CompositePath path = CompositePath::kAuto;  ///< kAuto holds what each of the paths needs
  gles::LightMapFormat light_map = gles::LightMapFormat::kAuto;
  bool composite = true;  ///< false: planes are decoded and no more
  std::uint64_t light_bytes =
      0;  ///< that the caller's lights hold, pictures of environments above all
};

/// One line of the account. Heap is what malloc gives (thread stacks, code and the GL driver's own
/// memory are not in it); GPU is what textures, buffers and framebuffers hold by their formats.
struct MemoryTerm {
  std::string name;  ///< "program", "records", "meshes", …: a stable key
  std::string what;  ///< a sentence for people
  std::uint64_t heap_bytes = 0;
  std::uint64_t gpu_bytes = 0;
};

/// The plan and its account.
///
/// Order of sacrifice, from what goes first to what goes last:
///   1. the ring, frame by frame, down to two (the two that a picture may be blended from);
///   2. decode threads, down to one;
///   3. the composite path: `auto` becomes the one that takes least;
///   4. the light map's precision: half floats become 8-bit square roots;
///   5. layers, from the least important on, down to one.
/// Nothing is given up while giving up more of what comes before it would do: of all plans that
/// fit, the one with the most layers is taken, of those the one with the better light map, and so
/// on up to the longest ring. What is no wish (the file's records, a decoder's reference pictures)
/// cannot be given up.
struct MemoryPlan {
  std::uint64_t budget_bytes = 0;  ///< as asked for; UINT64_MAX: none
  std::uint64_t ring_frames = 0;
  std::uint64_t ring_bytes = 0;   ///< ring_frames decoded frames, their poses included
  std::uint64_t frame_bytes = 0;  ///< one of them
  int threads = 1;                ///< decode workers
  int decoder_threads = 1;  ///< frame threads of each mantissa decoder (PrefetchOptions::threads)
  std::uint64_t packet_bytes = 0;    ///< coded chunks that may wait (PrefetchOptions::packet_bytes)
  std::vector<std::uint8_t> layers;  ///< by layer of the clip's model, 0: left out
  CompositePath path = CompositePath::kAuto;
  gles::LightMapFormat light_map = gles::LightMapFormat::kHalfFloat;
  std::vector<MemoryTerm> terms;      ///< all of them, in the order of allocation
  std::vector<std::string> given_up;  ///< sentences, in the order of sacrifice; empty: nothing

  [[nodiscard]] std::uint64_t heap_bytes() const;
  [[nodiscard]] std::uint64_t gpu_bytes() const;
  [[nodiscard]] std::uint64_t total_bytes() const { return heap_bytes() + gpu_bytes(); }
  [[nodiscard]] int layer_count() const;
};

/// Chooses a plan whose total fits `budget_bytes` (none: whatever the wishes take). A budget beyond
/// what the machine has is the caller's own affair: plans do not grow with it beyond the wishes.
/// Errors: kOutOfMemory when even the smallest plan does not fit, naming the smallest budget that
/// would do; kNotFound for a clip that is not there; kInvalid for wishes out of range; those of
/// check_layer(). Allocates next to nothing itself.
[[nodiscard]] Result<MemoryPlan> plan_memory(const container::FileContents& contents,
                                             const SegmentScale& segments,
                                             const MemoryWishes& wishes,
                                             std::optional<std::uint64_t> budget_bytes);

/// What the smallest plan takes: the least budget that is not refused. Errors: as plan_memory().
[[nodiscard]] Result<std::uint64_t> smallest_budget(const container::FileContents& contents,
                                                    const SegmentScale& segments,
                                                    const MemoryWishes& wishes);

/// "8388608", "8MiB", "8M", "64k", "1.5GiB": powers of 1024. Errors: kInvalid.
[[nodiscard]] Result<std::uint64_t> parse_bytes(const std::string& text);

}  // namespace relit::player
