// SPDX-License-Identifier: MIT
#include "bake_minimal/bake.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "bake_minimal/frame_store.hpp"
#include "bake_minimal/parallel.hpp"
#include "bake_minimal/plane_encoder.hpp"
#include "bake_minimal/push_pull.hpp"
#include "bake_minimal/seams.hpp"
#include "container/byte_sink.hpp"
#include "container/writer.hpp"
#include "decoders/npy.hpp"
#include "decoders/plane_decoder.hpp"
#include "decoders/relit_error.hpp"
#include "decoders/sh.hpp"

namespace relit::bake {
namespace {

/// Of blended poses: a pixel where a character is a thousand tall.
constexpr double kMostPoseError = 1e-3;

class Stopwatch {
 public:
  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// One bake from beginning to end, in the order in which the data move.
class Bake {
 public:
  Bake(const BakeOptions& options, Progress& progress) : options_(options), progress_(progress) {}

  Result<std::vector<BakeSummary>> run() {
    for (const BakeOutput& output : outputs_of(options_)) RELIT_TRY(check_output(output.path));
    if (!options_.reference.empty()) RELIT_TRY(check_output(options_.reference));
    RELIT_ASSIGN(prepared_, prepare_bake(options_));
    summarize();
    RELIT_TRY(check_steps());
    RELIT_TRY(trace());
    std::optional<decoders::NpyWriter> reference;
    if (!options_.reference.empty()) {
      RELIT_ASSIGN(reference, write_reference());
    }
    std::vector<BakeSummary> summaries;
    for (const BakeOutput& output : outputs_of(options_)) {
      RELIT_ASSIGN(BakeSummary summary, write(output));
      summaries.push_back(std::move(summary));
    }
    if (reference) RELIT_TRY(reference->commit());
    return summaries;
  }

 private:
  /// The frames that a file keeps, and their normals where there is a prediction.
  struct Timeline {
    KeptFrames kept;
    std::unique_ptr<BakeNormals> normals;
  };

  static Status check_output(const std::filesystem::path& path);
  void summarize();
  Status find_seams(BakePoser& poser, const TraceGeometry& geometry);
  Status trace();
  Result<BakeSummary> write(const BakeOutput& output);
  [[nodiscard]] std::vector<std::uint8_t> covered_texels() const;  // [H][W], 1: covered
  Result<PlaneSplit> split_planes(const CodingOptions& coding, Timeline& frames);
  Result<std::vector<CodingVariant>> with_steps(std::vector<CodingVariant> candidates);
  Result<CodingOptions> choose(const BakeOutput& output);
  Result<CodingTrial> try_coding(RangeScan scan);
  [[nodiscard]] ModelIds ids() const;
  Result<CodingOptions> resolved(const CodingOptions& options);
  Result<const RangeScan*> scan_for(const CodingOptions& options);
  Result<RangeScan> scan_range(const CodingOptions& options);
  Result<decoders::NpyWriter> write_reference();  // not committed
  Result<Timeline*> timeline(int step);
  Status check_steps();
  Result<TransferFrame> fill_frame(Timeline& frames, std::uint64_t frame);  // of those kept
  Status score(Timeline& frames, const PlaneEncoder& encoder, decoders::PlaneDecoder& decoder,
               decoders::RelitError& error);
  Status write_static(container::Writer& writer, const KeptFrames& kept,
                      const PlaneEncoder& encoder);
  Status write_segments(container::Writer& writer, const KeptFrames& kept, PlaneEncoder& encoder);
  void fill_transfer(std::uint64_t frame);

  [[nodiscard]] std::size_t texels() const {
    return static_cast<std::size_t>(options_.transfer.width) *
           static_cast<std::size_t>(options_.transfer.height);
  }
  [[nodiscard]] std::size_t planes() const {
    return 3 * static_cast<std::size_t>(decoders::coefficient_count(options_.transfer.order));
  }

  const BakeOptions& options_;
  Progress& progress_;
  BakeSummary summary_;
  PreparedBake prepared_;
  std::optional<FrameStore> store_;                // [coefficients][3][samples] by frame
  std::vector<std::vector<std::uint8_t>> buried_;  // by frame; empty where nothing is
  std::optional<PushPull> push_pull_;              // for frames in which nothing is buried
  std::optional<SeamStitcher> stitcher_;
  std::map<int, Timeline> timelines_;  // by step
  std::vector<float> filled_;          // [coefficients][3][H][W] of the frame in hand
  std::vector<RangeScan> scans_;       // of each way to split and quantise that was asked for
  glm::vec3 bounds_min_{std::numeric_limits<float>::infinity()};
  glm::vec3 bounds_max_{-std::numeric_limits<float>::infinity()};
};

// An output that cannot be written should be known before an hour of tracing, not after it.
Status Bake::check_output(const std::filesystem::path& path) {
  RELIT_TRY(container::FileSink::create(path.string()));
  return {};
}

void Bake::summarize() {
  const Scene& scene = prepared_.scene;
  summary_.clip =
      prepared_.clip < 0 ? "rest pose" : scene.clips[static_cast<std::size_t>(prepared_.clip)].name;
  summary_.frames = prepared_.frames;
  summary_.order = options_.transfer.order;
  summary_.width = options_.transfer.width, summary_.height = options_.transfer.height;
  summary_.atlas = prepared_.atlas;
  for (const decoders::Mesh& mesh : prepared_.packed.meshes) {
    summary_.vertices += mesh.positions.size();
    summary_.triangles += mesh.indices.size() / 3;
  }
  summary_.samples = prepared_.samples.size();
  summary_.covered =
      static_cast<std::size_t>(std::count_if(prepared_.samples.begin(), prepared_.samples.end(),
                                             [](const TexelSample& s) { return s.covered; }));
  const auto add = [&](const std::vector<std::string>& warnings) {
    summary_.warnings.insert(summary_.warnings.end(), warnings.begin(), warnings.end());
  };
  add(scene.warnings), add(prepared_.packed.warnings), add(prepared_.packed.materials.warnings);
}

// Two moments tell what belongs together from what only touches.
Status Bake::find_seams(BakePoser& poser, const TraceGeometry& geometry) {
  RELIT_TRY(poser.pose(prepared_.frames / 2));
  const std::vector<glm::vec3> positions(poser.positions().begin(), poser.positions().end());
  const std::vector<glm::vec3> normals(poser.normals().begin(), poser.normals().end());
  RELIT_TRY(poser.pose(0));
  const std::vector<Seam> seams =
      bake::find_seams({geometry.indices, geometry.lightmap_uv, poser.positions(), poser.normals()},
                       {geometry.indices, geometry.lightmap_uv, positions, normals});
  stitcher_.emplace(options_.transfer.width, options_.transfer.height, seams, prepared_.samples);
  return {};
}

Status Bake::trace() {
  const Stopwatch watch;
  RELIT_ASSIGN(BakePoser poser, BakePoser::create(prepared_));
  TraceGeometry geometry = trace_geometry(prepared_.packed);
  RELIT_TRY(find_seams(poser, geometry));
  RELIT_ASSIGN(TransferTracer tracer,
               TransferTracer::create(std::move(geometry), prepared_.samples, options_.transfer));
  RELIT_ASSIGN(store_, FrameStore::create(options_.output.parent_path(), prepared_.frames,
                                          planes() * prepared_.samples.size()));
  buried_.resize(prepared_.frames);
  std::vector<std::uint8_t> flags(prepared_.samples.size());
  progress_.start("trace", prepared_.frames, "frame");
  for (std::uint64_t k = 0; k < prepared_.frames; ++k) {
    RELIT_TRY(poser.pose(k));
    for (const glm::vec3& p : poser.positions())
      bounds_min_ = glm::min(bounds_min_, p), bounds_max_ = glm::max(bounds_max_, p);
    RELIT_TRY(tracer.trace(poser.positions(), poser.normals(), store_->frame(k), flags));
    if (std::find(flags.begin(), flags.end(), 1) != flags.end()) buried_[k] = flags;
    const auto [least, largest] =
        std::ranges::minmax(store_->frame(k).first(3 * prepared_.samples.size()));
    summary_.least_t0 = std::min(summary_.least_t0, least);
    summary_.largest_t0 = std::max(summary_.largest_t0, largest);
    summary_.rays += tracer.rays();
    progress_.advance(k + 1);
  }
  progress_.finish();
  summary_.trace_s = watch.seconds();
  return {};
}

// Spreads the samples of a frame over its map, fills the rest and closes the seams.
void Bake::fill_transfer(std::uint64_t frame) {
  const std::vector<std::uint8_t>& buried = buried_[frame];
  std::optional<PushPull> own;
  if (!buried.empty() || !push_pull_) {
    std::vector<std::uint8_t> valid(texels(), 0);
    bool any = false;
    for (std::size_t s = 0; s < prepared_.samples.size(); ++s) {
      const bool seen = buried.empty() || buried[s] == 0;
      valid[prepared_.samples[s].texel] = seen ? 1 : 0;
      any |= seen;
    }
    // All of it inside itself: better the traced values than nothing.
    if (!any) {
      for (const TexelSample& sample : prepared_.samples) valid[sample.texel] = 1;
    }
    own.emplace(options_.transfer.width, options_.transfer.height, valid);
    if (buried.empty()) push_pull_ = std::move(own), own.reset();
  }
  const PushPull& push_pull = own ? *own : *push_pull_;
  const std::span<const float> values = std::as_const(*store_).frame(frame);
  filled_.resize(planes() * texels());
  parallel_for(thread_count(options_.transfer.threads), planes(), [&](std::size_t plane) {
    const std::span<float> out(filled_.data() + plane * texels(), texels());
    for (std::size_t s = 0; s < prepared_.samples.size(); ++s)
      out[prepared_.samples[s].texel] = values[plane * prepared_.samples.size() + s];
    push_pull.fill(out);
    stitcher_->stitch(out);
  });
}

Result<Bake::Timeline*> Bake::timeline(int step) {
  const auto found = timelines_.find(step);
  if (found != timelines_.end()) return &found->second;
  RELIT_ASSIGN(KeptFrames kept, keep_frames(prepared_, step));
  return &(timelines_[step] = Timeline{std::move(kept), nullptr});
}

// A step that does not fit the clip should be known before an hour of tracing, too.
Status Bake::check_steps() {
  for (const BakeOutput& output : outputs_of(options_))
    for (const CodingVariant& each : output.candidates)
      RELIT_TRY(timeline(std::max(each.coding.frame_step, 1)));
  return {};
}

Result<TransferFrame> Bake::fill_frame(Timeline& frames, std::uint64_t frame) {
  fill_transfer(frame * static_cast<std::uint64_t>(frames.kept.step));
  TransferFrame filled{filled_};
  if (frames.normals) {
    RELIT_ASSIGN(filled.normals, frames.normals->at(frame));
  }
  return filled;
}

Status Bake::write_static(container::Writer& writer, const KeptFrames& kept,
                          const PlaneEncoder& encoder) {
  container::ClipRecord clip;
  clip.id = kept.pose.track.clip_id;
  clip.name = summary_.clip;
  clip.tick_rate = kept.rate;
  clip.frame_count = clip.duration_ticks = kept.count;
  clip.loop = options_.loop && prepared_.frames > 1;
  for (int a = 0; a < 3; ++a) {
    clip.bounds_min[static_cast<std::size_t>(a)] = bounds_min_[a];
    clip.bounds_max[static_cast<std::size_t>(a)] = bounds_max_[a];
  }
  RELIT_TRY(writer.add(clip));
  const std::uint64_t before_images = writer.bytes_written();
  for (const auto& image : prepared_.packed.materials.images) RELIT_TRY(writer.add(image));
  summary_.image_bytes = writer.bytes_written() - before_images;
  for (const auto& material : prepared_.packed.materials.materials) RELIT_TRY(writer.add(material));
  const std::uint64_t before_meshes = writer.bytes_written();
  for (const auto& mesh : prepared_.packed.mesh_records) RELIT_TRY(writer.add(mesh));
  summary_.mesh_bytes = writer.bytes_written() - before_meshes;
  RELIT_TRY(writer.add(prepared_.packed.skeleton));
  const std::uint64_t before_track = writer.bytes_written();
  RELIT_TRY(writer.add(kept.pose.track));
  summary_.pose_bytes += writer.bytes_written() - before_track;
  RELIT_TRY(writer.add(encoder.model()));
  for (const auto& layer : encoder.layers()) RELIT_TRY(writer.add(layer));
  return {};
}

Status Bake::write_segments(container::Writer& writer, const KeptFrames& kept,
                            PlaneEncoder& encoder) {
  while (std::optional<EncodedSegment> segment = encoder.take_segment()) {
    const std::uint64_t first = segment->segment.first_frame;
    for (const container::ChunkRecord& chunk : segment->chunks)
      summary_.video_bytes += chunk.data.size();
    container::ChunkRecord pose;
    pose.track_id = kept.pose.track.track_id;
    pose.data = kept.pose.packets[first / kept.segment_frames];
    pose.packets.push_back({static_cast<std::int64_t>(first), true, 0, pose.data.size()});
    segment->chunks.insert(segment->chunks.begin(), std::move(pose));
    RELIT_TRY(writer.write_segment({kept.pose.track.clip_id, first, segment->segment.frame_count},
                                   std::move(segment->chunks)));
  }
  return {};
}

std::vector<std::uint8_t> Bake::covered_texels() const {
  std::vector<std::uint8_t> covered(texels(), 0);
  for (const TexelSample& sample : prepared_.samples)
    covered[sample.texel] = sample.covered ? 1 : 0;
  return covered;
}

// Principal planes take a pass of their own over the clip.
Result<PlaneSplit> Bake::split_planes(const CodingOptions& coding, Timeline& frames) {
  const TransferShape shape{options_.transfer.order, options_.transfer.width,
                            options_.transfer.height};
  if (coding.planes == Planes::kColour) return PlaneSplit::colour(shape, coding);
  std::vector<std::uint8_t> known(texels(), 0);
  if (coding.predict) {
    if (!frames.normals) {
      RELIT_ASSIGN(frames.normals,
                   BakeNormals::create(prepared_, frames.kept, shape.width, shape.height));
    }
    known = frames.normals->mask();
  } else {
    for (const TexelSample& sample : prepared_.samples) known[sample.texel] = 1;
  }
  PrincipalAnalysis analysis(shape, coding.predict, covered_texels());
  progress_.start("analyse", frames.kept.count, "frame");
  for (std::uint64_t k = 0; k < frames.kept.count; ++k) {
    RELIT_ASSIGN(const TransferFrame frame, fill_frame(frames, k));
    RELIT_TRY(analysis.add_frame(frame));
    progress_.advance(k + 1);
  }
  progress_.finish();
  return PlaneSplit::principal(shape, analysis.finish(coding.principal_count), known);
}

ModelIds Bake::ids() const {
  ModelIds ids;
  ids.clip_id = prepared_.pose.track.clip_id;
  ids.first_track_id = prepared_.pose.track.track_id + 1;
  return ids;
}

Result<CodingOptions> Bake::resolved(const CodingOptions& options) {
  CodingOptions coding = options;
  RELIT_ASSIGN(const Timeline* const frames, timeline(std::max(options.frame_step, 1)));
  coding.segment_frames = static_cast<int>(frames->kept.segment_frames);
  coding.threads = thread_count(options_.transfer.threads);
  return resolve(coding);
}

// Measures what the planes have to hold.
Result<RangeScan> Bake::scan_range(const CodingOptions& coding) {
  RELIT_ASSIGN(Timeline* const frames, timeline(coding.frame_step));
  RELIT_ASSIGN(PlaneSplit split, split_planes(coding, *frames));
  RELIT_ASSIGN(RangeScan scan, RangeScan::create(std::move(split), coding));
  progress_.start("measure", frames->kept.count, "frame");
  for (std::uint64_t k = 0; k < frames->kept.count; ++k) {
    RELIT_ASSIGN(const TransferFrame frame, fill_frame(*frames, k));
    RELIT_TRY(scan.add_frame(frame));
    progress_.advance(k + 1);
  }
  progress_.finish();
  return scan;
}

// Ways to code that differ in the stream alone share two passes over the clip.
Result<const RangeScan*> Bake::scan_for(const CodingOptions& coding) {
  for (RangeScan& scan : scans_) {
    if (!same_planes(scan.options(), coding)) continue;
    scan.set_stream(coding);
    return &scan;
  }
  RELIT_ASSIGN(RangeScan scan, scan_range(coding));
  scans_.push_back(std::move(scan));
  return &scans_.back();
}

Result<decoders::NpyWriter> Bake::write_reference() {
  const std::uint64_t shape[] = {prepared_.frames, planes() / 3, 3,
                                 static_cast<std::uint64_t>(options_.transfer.height),
                                 static_cast<std::uint64_t>(options_.transfer.width)};
  RELIT_ASSIGN(
      decoders::NpyWriter reference,
      decoders::NpyWriter::create(options_.reference, decoders::NpyWriter::Type::kFloat32, shape));
  for (std::uint64_t k = 0; k < prepared_.frames; ++k) {
    fill_transfer(k);
    RELIT_TRY(reference.write(filled_));
  }
  return reference;
}

// Leaving frames out is a candidate where blending moves the surface by less than what shows.
Result<std::vector<CodingVariant>> Bake::with_steps(std::vector<CodingVariant> candidates) {
  if (candidates.front().coding.frame_step != 0) return candidates;
  std::vector<int> steps;
  for (const int step : {2, 3, 4}) {
    const auto every = static_cast<std::uint64_t>(step);
    if (prepared_.frames % every != 0 || prepared_.frames / every < 3) continue;
    RELIT_ASSIGN(const Timeline* const frames, timeline(step));
    if (frames->kept.pose_error <= kMostPoseError) steps.push_back(step);
  }
  std::vector<CodingVariant> all;
  for (CodingVariant& each : candidates) {
    each.coding.frame_step = 1;
    all.push_back(each);
    for (const int step : steps) {
      all.push_back(each);
      all.back().coding.frame_step = step;
      all.back().name += " 1/" + std::to_string(step);
    }
  }
  return all;
}

// Searches the candidates for what the goal asks.
Result<CodingOptions> Bake::choose(const BakeOutput& output) {
  if (!options_.goal) return resolved(output.candidates.front().coding);
  RELIT_ASSIGN(const std::vector<CodingVariant> candidates, with_steps(output.candidates));
  const double clip_s = prepared_.time_s(prepared_.frames);
  const auto attempt = [&](std::size_t candidate, double crf) -> Result<CodingTrial> {
    CodingOptions coding = candidates[candidate].coding;
    coding.crf = crf;
    RELIT_ASSIGN(coding, resolved(coding));
    RELIT_ASSIGN(const RangeScan* const scan, scan_for(coding));
    return try_coding(*scan);
  };
  RELIT_ASSIGN(summary_.choice, choose_coding(*options_.goal, candidates, clip_s, attempt));
  CodingOptions coding = candidates[summary_.choice->candidate].coding;
  coding.crf = summary_.choice->trial.crf;
  return resolved(coding);
}

// Codes and decodes the whole clip.
Result<CodingTrial> Bake::try_coding(RangeScan scan) {
  CodingTrial trial{*scan.options().crf, 0, {}};
  RELIT_ASSIGN(Timeline* const frames, timeline(scan.options().frame_step));
  for (const auto& packet : frames->kept.pose.packets) trial.bytes += packet.size();
  RELIT_ASSIGN(PlaneEncoder encoder, PlaneEncoder::begin(std::move(scan), ids()));
  RELIT_ASSIGN(auto decoder, decoders::PlaneDecoder::open(encoder.model(), encoder.layers()));
  const auto take = [&]() -> Status {
    while (std::optional<EncodedSegment> segment = encoder.take_segment()) {
      for (container::ChunkRecord& chunk : segment->chunks) {
        trial.bytes += chunk.data.size();
        RELIT_TRY(decoder.add_chunk(segment->segment, std::move(chunk)));
      }
    }
    return {};
  };
  progress_.start("try", frames->kept.count + prepared_.frames, "frame");
  for (std::uint64_t k = 0; k < frames->kept.count; ++k) {
    RELIT_ASSIGN(const TransferFrame frame, fill_frame(*frames, k));
    RELIT_TRY(encoder.encode_frame(frame));
    RELIT_TRY(take());
    progress_.advance(k + 1);
  }
  RELIT_TRY(encoder.finish());
  RELIT_TRY(take());
  decoders::RelitError error(decoders::standard_lights(),
                             decoders::coefficient_count(options_.transfer.order),
                             covered_texels());
  RELIT_TRY(score(*frames, encoder, decoder, error));
  progress_.finish();
  trial.figures = error.figures();
  return trial;
}

// Every frame that was traced against what a player shows then: those that were left out are
// blended, at the end into the first where the clip loops.
Status Bake::score(Timeline& frames, const PlaneEncoder& encoder, decoders::PlaneDecoder& decoder,
                   decoders::RelitError& error) {
  std::vector<float> first, before, now(planes() * texels()), blended(now.size());
  decoders::FrameView view;
  const int step = frames.kept.step;
  const auto compare = [&](std::uint64_t frame, std::span<const float> decoded) {
    fill_transfer(frame);
    error.add_frame(filled_, decoded);
    progress_.advance(frames.kept.count + frame + 1);
  };
  const auto compare_between = [&](std::uint64_t kept, std::span<const float> next) {
    for (int i = 1; i < step; ++i) {
      const float t = static_cast<float>(i) / static_cast<float>(step);
      for (std::size_t v = 0; v < blended.size(); ++v)
        blended[v] = std::lerp(before[v], next[v], t);
      compare(kept * static_cast<std::uint64_t>(step) + static_cast<std::uint64_t>(i), blended);
    }
  };
  for (std::uint64_t k = 0; k < frames.kept.count; ++k) {
    RELIT_ASSIGN(const TransferFrame frame, fill_frame(frames, k));
    RELIT_TRY(decoder.frame(k, view));
    RELIT_TRY(decoders::reconstruct(view.planes(), encoder.model(), encoder.layers(), now,
                                    frame.normals));
    if (k > 0) compare_between(k - 1, now);
    compare(k * static_cast<std::uint64_t>(step), now);
    if (step == 1) continue;
    if (k == 0) first = now;
    before = now;
  }
  if (step > 1) compare_between(frames.kept.count - 1, options_.loop ? first : before);
  return {};
}

Result<BakeSummary> Bake::write(const BakeOutput& output) {
  const Stopwatch watch;
  const BakeSummary before = summary_;
  RELIT_ASSIGN(summary_.coding, choose(output));
  RELIT_ASSIGN(Timeline* const frames, timeline(summary_.coding.frame_step));
  const KeptFrames& kept = frames->kept;
  summary_.frames = kept.count, summary_.frame_rate = kept.rate;
  for (const auto& packet : kept.pose.packets) summary_.pose_bytes += packet.size();
  RELIT_ASSIGN(const RangeScan* const scan, scan_for(summary_.coding));
  RELIT_ASSIGN(PlaneEncoder encoder, PlaneEncoder::begin(*scan, ids()));
  summary_.decoder_bytes = encoder.decoder_bytes();
  RELIT_ASSIGN(auto sink, container::FileSink::create(output.path.string()));
  RELIT_ASSIGN(container::Writer writer,
               container::Writer::create(*sink, "relit-bake " RELIT_VERSION));
  RELIT_TRY(write_static(writer, kept, encoder));
  progress_.start("code", kept.count, "frame");
  for (std::uint64_t k = 0; k < kept.count; ++k) {
    RELIT_ASSIGN(const TransferFrame frame, fill_frame(*frames, k));
    RELIT_TRY(encoder.encode_frame(frame));
    RELIT_TRY(write_segments(writer, kept, encoder));
    progress_.advance(k + 1);
  }
  RELIT_TRY(encoder.finish());
  RELIT_TRY(write_segments(writer, kept, encoder));
  RELIT_TRY(writer.finish());
  progress_.finish();
  RELIT_TRY(sink->commit());
  summary_.bytes = writer.bytes_written();
  summary_.code_s = watch.seconds();
  summary_.output = output.path;
  return std::exchange(summary_, before);
}

}  // namespace

Result<std::vector<BakeSummary>> bake(const BakeOptions& options, Progress& progress) {
  return Bake(options, progress).run();
}

}  // namespace relit::bake
