// SPDX-License-Identifier: MIT
#pragma once
#include <memory>

#include "player/clip_frame.hpp"
#include "player/interrupt.hpp"
namespace relit::player {
struct DemuxOptions {
  std::string clip;
  bool sparing = false;
  std::shared_ptr<Interrupt> interrupt;
};
class ClipDemuxer {
 public:
  struct Statics {
    container::FileContents contents;
    std::vector<decoders::Mesh> meshes;
  };
  static Result<ClipDemuxer> open(std::unique_ptr<container::ByteSource> source,
                                  const std::string& name, const DemuxOptions& options) {
    ClipOptions o;
    o.clip = options.clip;
    const bool seekable = source->seekable();
    RELIT_ASSIGN(ClipReader r, ClipReader::open(std::move(source), name, o));
    ClipDemuxer d;
    d.name_ = name;
    d.reader = std::make_shared<ClipReader>(std::move(r));
    d.can_seek = seekable;
    d.options_ = options;
    d.statics_ = std::make_shared<Statics>(Statics{d.reader->contents(), d.reader->meshes()});
    return d;
  }
  Result<ClipDemuxer> another(std::unique_ptr<container::ByteSource> source,
                              const DemuxOptions& options) const {
    RELIT_ASSIGN(ClipDemuxer d, open(std::move(source), name_, options));
    d.statics_ = statics_;
    return d;
  }
  const std::shared_ptr<const Statics>& statics() const { return statics_; }
  const container::ClipRecord& clip() const { return reader->clip(); }
  const std::vector<container::LayerRecord>& layers() const { return reader->layers(); }
  std::shared_ptr<ClipReader> reader;
  bool can_seek = false;

 private:
  std::string name_;
  DemuxOptions options_;
  std::shared_ptr<const Statics> statics_;
};
}  // namespace relit::player
