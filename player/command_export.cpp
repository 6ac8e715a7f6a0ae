// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdio>
#include <map>
#include <optional>

#include "player/command.hpp"
#include "player/matroska.hpp"
#include "player/source.hpp"
#include "player/video_tracks.hpp"

namespace relit::player {
namespace {

struct ExportArguments {
  std::string source, output, clip;
};

/// One clip's way into a Matroska file.
class Export {
 public:
  static Result<Export> begin(const container::FileContents& contents,
                              const ExportArguments& arguments);

  /// Errors: the output's; kUnsupported where frames are too short for Matroska.
  Status take(const container::Record& record);
  Status finish() { return writer_.finish(); }

  [[nodiscard]] std::uint32_t clip_id() const { return times_.clip().id; }
  [[nodiscard]] std::vector<std::uint32_t> track_ids() const;
  [[nodiscard]] std::uint64_t packets() const { return packets_; }

 private:
  Export(const container::ClipRecord& clip, std::vector<VideoTrack> tracks, MatroskaWriter writer)
      : times_(clip), tracks_(std::move(tracks)), writer_(std::move(writer)) {}
  Status write(const container::ChunkRecord& chunk, std::size_t track);

  ClipTimes times_;
  std::vector<VideoTrack> tracks_;
  MatroskaWriter writer_;
  std::optional<container::SegmentRecord> segment_;
  std::uint64_t packets_ = 0;
};

Result<Export> Export::begin(const container::FileContents& contents,
                             const ExportArguments& arguments) {
  RELIT_ASSIGN(const container::ClipRecord* clip,
               find_clip(contents, arguments.clip, arguments.source));
  std::vector<VideoTrack> tracks = video_tracks(contents, clip->id);
  if (tracks.empty()) {
    return fail(ErrorCode::kUnsupported,
                arguments.source + ": clip \"" + clip->name + "\" has no video tracks");
  }
  std::vector<MatroskaTrack> streams;
  for (const VideoTrack& track : tracks) streams.push_back(track.stream);
  RELIT_ASSIGN(MatroskaWriter writer,
               MatroskaWriter::create(arguments.output, clip->name, std::move(streams)));
  return Export(*clip, std::move(tracks), std::move(writer));
}

std::vector<std::uint32_t> Export::track_ids() const {
  std::vector<std::uint32_t> ids;
  for (const VideoTrack& track : tracks_) ids.push_back(track.stream.track_id);
  return ids;
}

Status Export::take(const container::Record& record) {
  if (const auto* segment = std::get_if<container::SegmentRecord>(&record.body)) {
    segment_.reset();
    if (segment->clip_id != times_.clip().id) return {};
    RELIT_TRY(times_.begin(*segment, writer_.resolution_ns()));
    segment_ = *segment;
    return {};
  }
  const auto* chunk = std::get_if<container::ChunkRecord>(&record.body);
  if (chunk == nullptr || !segment_) return {};
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (tracks_[i].stream.track_id == chunk->track_id) return write(*chunk, i);
  }
  return {};
}

Status Export::write(const container::ChunkRecord& chunk, std::size_t track) {
  std::vector<std::int64_t> shown;
  for (const container::Packet& packet : chunk.packets) shown.push_back(packet.pts);
  // Decoding times are the earliest that is still to be shown.
  std::vector<std::int64_t> earliest = shown;
  for (std::size_t i = earliest.size() - 1; i-- > 0;) {
    earliest[i] = std::min(earliest[i], earliest[i + 1]);
  }
  std::sort(shown.begin(), shown.end());
  for (std::size_t i = 0; i < chunk.packets.size(); ++i) {
    const container::Packet& packet = chunk.packets[i];
    const auto next = std::upper_bound(shown.begin(), shown.end(), packet.pts);
    const std::int64_t end_ns =
        next == shown.end() ? times_.end_ns() : times_.time_ns(static_cast<std::uint64_t>(*next));
    MatroskaWriter::Timing timing;
    timing.time_ns = times_.time_ns(static_cast<std::uint64_t>(packet.pts));
    timing.decode_ns = times_.time_ns(static_cast<std::uint64_t>(earliest[i]));
    timing.duration_ns = end_ns - timing.time_ns;
    const auto bytes = std::span(chunk.data).subspan(packet.offset, packet.size);
    RELIT_TRY(writer_.add(track, bytes, packet.key, timing));
    ++packets_;
  }
  return {};
}

/// Reads the segments to the end; returns what was lost first, empty if nothing was.
Result<std::string> write_segments(container::Reader& reader, Export& output) {
  std::string damage;
  for (;;) {
    auto record = reader.next();
    if (record && !*record) break;
    if (record) {
      RELIT_TRY(output.take(**record));
      continue;
    }
    const Error& error = record.error();
    if (error.code == ErrorCode::kIo || error.code == ErrorCode::kUnsupported) {
      return Unexpected{error};
    }
    if (damage.empty()) damage = error.message;
    if (reader.can_continue()) continue;
    RELIT_ASSIGN(const bool found, reader.resync());
    if (!found) break;
  }
  if (damage.empty() && !reader.finished()) damage = "the end of the file is missing";
  return damage;
}

int run_export(const ExportArguments& arguments) {
  auto source = open_source(arguments.source);
  if (!source) return report(source.error());
  auto reader = container::Reader::open(std::move(*source));
  if (!reader) return report_in(arguments.source, reader.error());
  const auto contents = container::load_static(*reader);
  if (!contents) return report_in(arguments.source, contents.error());
  auto output = Export::begin(*contents, arguments);
  if (!output) return report(output.error());
  reader->set_wanted_tracks(output->track_ids());
  const auto damage = write_segments(*reader, *output);
  if (!damage) return report_in(arguments.source, damage.error());
  if (const Status finished = output->finish(); !finished) return report(finished.error());
  std::fprintf(stderr, "relit: %s: %zu tracks, %llu packets\n", arguments.output.c_str(),
               output->track_ids().size(), static_cast<unsigned long long>(output->packets()));
  if (damage->empty()) return kSuccess;
  std::fprintf(stderr, "relit: %s: damaged, some packets are missing: %s\n",
               arguments.source.c_str(), damage->c_str());
  return kWithLosses;
}

}  // namespace

void add_export(CommandLine& line) {
  Options command = line.add("export", "write the video tracks of a clip as a Matroska file");
  const auto arguments = std::make_shared<ExportArguments>();
  command.add("source", arguments->source, "path, - or http(s)://").required();
  command.add("-o,--output", arguments->output, "the .mkv file").required();
  command.add("--clip", arguments->clip, "by name or number");
  command.footer(
      "Every stream's tag RELIT_TRACK is the number of its track; packets are copied as they are.\n"
      "Example:\n  relit export man.relit -o man.mkv && ffprobe man.mkv");
  command.runs([arguments] { return run_export(*arguments); });
}

}  // namespace relit::player
