// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdio>
#include <optional>
#include <utility>

#include "container/byte_sink.hpp"
#include "container/writer.hpp"
#include "decoders/codec_private.hpp"
#include "player/command.hpp"
#include "player/packet_feed.hpp"
#include "player/source.hpp"
#include "player/video_tracks.hpp"

namespace relit::player {
namespace {

using container::FileContents;

struct ImportArguments {
  std::string source, matroska, output;
};

/// Finds the clip whose tracks the Matroska file holds; all have to be of one.
Result<const container::ClipRecord*> clip_of(const FileContents& contents, const PacketFeed& feed,
                                             const ImportArguments& a) {
  if (feed.tracks().empty()) {
    return fail(ErrorCode::kCorrupt,
                a.matroska + ": no stream has a tag RELIT_TRACK, as `relit export` writes it");
  }
  for (const container::ClipRecord& clip : contents.clips) {
    const std::vector<VideoTrack> tracks = video_tracks(contents, clip.id);
    const auto known = [&](const MatroskaTrack& stream) {
      return std::any_of(tracks.begin(), tracks.end(), [&](const VideoTrack& track) {
        return track.stream.track_id == stream.track_id;
      });
    };
    if (std::all_of(feed.tracks().begin(), feed.tracks().end(), known)) return &clip;
  }
  std::string ids;
  for (const MatroskaTrack& stream : feed.tracks()) {
    ids += (ids.empty() ? "" : ", ") + std::to_string(stream.track_id);
  }
  return fail(ErrorCode::kCorrupt,
              a.source + ": no clip has all the video tracks of " + a.matroska + ": " + ids);
}

/// Puts what a stream says of its codec into the record of its layer.
Status describe_track(const MatroskaTrack& stream, const VideoTrack& track,
                      container::LayerRecord& layer, const std::string& file) {
  const std::string where = file + ": track " + std::to_string(stream.track_id);
  if (stream.codec != track.stream.codec) {
    return fail(ErrorCode::kUnsupported, where + " is coded with " + stream.codec +
                                             ", its layer with " + track.stream.codec);
  }
  if (stream.width != track.stream.width || stream.height != track.stream.height) {
    return fail(ErrorCode::kCorrupt, where + ": pictures of " + std::to_string(stream.width) + "x" +
                                         std::to_string(stream.height) + ", its layer has " +
                                         std::to_string(track.stream.width) + "x" +
                                         std::to_string(track.stream.height));
  }
  const auto stored = decoders::stored_private(stream.codec, stream.codec_private);
  const auto pictures =
      stored ? decoders::decoder_pictures(stream.codec, *stored) : Unexpected{stored.error()};
  if (!pictures) {
    return fail(pictures.error().code, where + ": its headers: " + pictures.error().message);
  }
  (track.exponents ? layer.exponent_private : layer.codec_private) = *stored;
  (track.exponents ? layer.exponent_pictures : layer.mantissa_pictures) = *pictures;
  return {};
}

/// Copies a file, with chunks of its own for the tracks of the Matroska file.
class Import {
 public:
  Import(container::Reader& reader, PacketFeed& feed, const container::ClipRecord& clip)
      : reader_(reader), feed_(feed), times_(clip) {}

  Status run(FileContents contents, container::ByteSink& sink, const std::string& file);

 private:
  Status replace_headers(FileContents& contents, const std::string& file) const;
  void choose_kept_tracks(const FileContents& contents);
  Status take(container::Record record, container::Writer& writer);
  /// Writes the segment when all its chunks are here.
  Status flush(container::Writer& writer);

  container::Reader& reader_;
  PacketFeed& feed_;
  ClipTimes times_;
  std::vector<std::uint32_t> kept_;  ///< tracks whose chunks are copied, sorted
  std::optional<container::SegmentRecord> segment_;
  std::size_t missing_ = 0;  ///< chunks of the segment that are still to be copied
  std::vector<container::ChunkRecord> chunks_;
};

Status Import::replace_headers(FileContents& contents, const std::string& file) const {
  const std::vector<VideoTrack> tracks = video_tracks(contents, times_.clip().id);
  for (const MatroskaTrack& stream : feed_.tracks()) {
    const auto track = std::find_if(tracks.begin(), tracks.end(), [&](const VideoTrack& t) {
      return t.stream.track_id == stream.track_id;
    });
    RELIT_TRY(describe_track(stream, *track, contents.layers[track->layer], file));
  }
  return {};
}

void Import::choose_kept_tracks(const FileContents& contents) {
  for (const container::PoseTrackRecord& pose : contents.pose_tracks) {
    kept_.push_back(pose.track_id);
  }
  for (const container::LayerRecord& layer : contents.layers) {
    kept_.push_back(layer.mantissa_track);
    if (layer.has_exponents) kept_.push_back(layer.exponent_track);
  }
  for (const MatroskaTrack& stream : feed_.tracks()) std::erase(kept_, stream.track_id);
  std::sort(kept_.begin(), kept_.end());
  reader_.set_wanted_tracks(kept_);
}

Status write_static(const FileContents& contents, container::Writer& writer) {
  for (const auto& record : contents.clips) RELIT_TRY(writer.add(record));
  for (const auto& record : contents.images) RELIT_TRY(writer.add(record));
  for (const auto& record : contents.materials) RELIT_TRY(writer.add(record));
  for (const auto& record : contents.meshes) RELIT_TRY(writer.add(record));
  if (contents.skeleton != container::SkeletonRecord{}) RELIT_TRY(writer.add(contents.skeleton));
  for (const auto& record : contents.pose_tracks) RELIT_TRY(writer.add(record));
  for (const auto& record : contents.models) RELIT_TRY(writer.add(record));
  for (const auto& record : contents.layers) RELIT_TRY(writer.add(record));
  return {};
}

Status Import::run(FileContents contents, container::ByteSink& sink, const std::string& file) {
  RELIT_TRY(replace_headers(contents, file));
  choose_kept_tracks(contents);
  RELIT_ASSIGN(container::Writer writer, container::Writer::create(sink, "relit " RELIT_VERSION));
  RELIT_TRY(write_static(contents, writer));
  for (;;) {
    RELIT_ASSIGN(std::optional<container::Record> record, reader_.next());
    if (!record) break;
    RELIT_TRY(take(std::move(*record), writer));
  }
  RELIT_TRY(feed_.finish());
  return writer.finish();
}

Status Import::take(container::Record record, container::Writer& writer) {
  if (auto* segment = std::get_if<container::SegmentRecord>(&record.body)) {
    missing_ = static_cast<std::size_t>(
        std::count_if(segment->chunks.begin(), segment->chunks.end(), [&](const auto& chunk) {
          return std::binary_search(kept_.begin(), kept_.end(), chunk.track_id);
        }));
    segment_ = std::move(*segment);
    return flush(writer);
  }
  if (auto* chunk = std::get_if<container::ChunkRecord>(&record.body); chunk && segment_) {
    chunks_.push_back(std::move(*chunk));
    --missing_;
    return flush(writer);
  }
  return {};
}

Status Import::flush(container::Writer& writer) {
  if (missing_ > 0) return {};
  if (segment_->clip_id == times_.clip().id) {
    RELIT_TRY(times_.begin(*segment_, feed_.resolution_ns()));
    for (std::size_t track = 0; track < feed_.tracks().size(); ++track) {
      RELIT_ASSIGN(container::ChunkRecord chunk, feed_.chunk(*segment_, track, times_));
      chunks_.push_back(std::move(chunk));
    }
  }
  container::SegmentInfo info;
  info.clip_id = segment_->clip_id;
  info.first_frame = segment_->first_frame;
  info.frame_count = segment_->frame_count;
  info.durations = std::move(segment_->durations);
  const std::string name = "segment " + std::to_string(segment_->index);
  segment_.reset();
  // What the writer refuses here is the fault of the input.
  const Status written = writer.write_segment(info, std::exchange(chunks_, {}));
  if (written || written.error().code != ErrorCode::kInvalid) return written;
  return fail(ErrorCode::kCorrupt, name + ": " + written.error().message);
}

Status import_file(const ImportArguments& a) {
  RELIT_ASSIGN(auto source, open_source(a.source));
  const auto in_source = [&](const Error& error) {
    return fail(error.code, a.source + ": " + error.message);
  };
  auto reader = container::Reader::open(std::move(source));
  if (!reader) return in_source(reader.error());
  auto contents = container::load_static(*reader);
  if (!contents) return in_source(contents.error());
  RELIT_ASSIGN(MatroskaReader matroska, MatroskaReader::open(a.matroska));
  PacketFeed feed(std::move(matroska), a.matroska);
  RELIT_ASSIGN(const container::ClipRecord* clip, clip_of(*contents, feed, a));
  RELIT_ASSIGN(const auto sink, container::FileSink::create(a.output));
  Import import(*reader, feed, container::ClipRecord(*clip));
  RELIT_TRY(import.run(std::move(*contents), *sink, a.matroska));
  RELIT_TRY(sink->commit());
  std::fprintf(stderr, "relit: %s: %zu tracks, %llu packets\n", a.output.c_str(),
               feed.tracks().size(), static_cast<unsigned long long>(feed.packets()));
  return {};
}

int run_import(const ImportArguments& arguments) {
  const Status status = import_file(arguments);
  return status ? kSuccess : report(status.error());
}

}  // namespace

void add_import(CommandLine& line) {
  Options command = line.add("import", "put the video tracks of a Matroska file back into a clip");
  const auto arguments = std::make_shared<ImportArguments>();
  command.add("source", arguments->source, "the .relit file: path, - or http(s)://").required();
  command.add("matroska", arguments->matroska, "as `relit export` wrote it, or remuxed").required();
  command.add("-o,--output", arguments->output, "the new .relit file").required();
  command.footer(
      "Tracks that the Matroska file lacks keep their packets. Segments stay where they are: "
      "every\n"
      "one has to begin with a key frame. Records that this version does not know are left out.\n"
      "Example:\n  relit import man.relit man.mkv -o new.relit");
  command.runs([arguments] { return run_import(*arguments); });
}

}  // namespace relit::player
