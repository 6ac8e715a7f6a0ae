// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "container/base/result.hpp"
#include "container/byte_sink.hpp"
#include "player/rewrite.hpp"

namespace relit::player {

/// Writes all clips of several files as one file: first those of sources[0], and so on. All must
/// show the same character: the same images, materials, meshes and skeleton in the same order,
/// whatever their ids, which become those of the first file. Ids of clips, models, layers and
/// tracks change where they clash; clip names that are taken get " 2", " 3", … Nothing is decoded
/// or encoded. Reads forward only, each source after the one before. On failure the sink holds
/// rubbish. Errors: kInvalid naming the first difference, kLimit for more than one file may hold;
/// those of sources and sink.
Status concat(std::vector<RewriteSource>& sources, container::ByteSink& sink);

}  // namespace relit::player
