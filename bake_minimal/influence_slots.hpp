// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include "container/records.hpp"
#include "decoders/vertex_prediction.hpp"

namespace relit::bake {

/// Moves the influences of each vertex to the slots where the vertex that it is predicted from has
/// the same joints, and names that one's joints in slots without weight: which slot an influence
/// stands in means nothing, and what stays the same costs nothing. `streams`: those of a mesh, not
/// yet coded; joints and weights in equal numbers.
void match_influence_slots(std::span<container::VertexStream> streams,
                           const decoders::VertexLinks& links);

}  // namespace relit::bake
