// SPDX-License-Identifier: MIT
#include "bake_minimal/influence_slots.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace relit::bake {
namespace {

using container::Semantic;
using container::VertexStream;

struct Slot {
  std::uint16_t joint = 0;
  std::uint8_t weight = 0;
};

class Slots {
 public:
  explicit Slots(std::span<VertexStream> streams) {
    for (VertexStream& s : streams) {
      if (s.semantic == Semantic::kJoints) joints_.push_back(&s);
      if (s.semantic == Semantic::kWeights) weights_.push_back(&s);
    }
  }

  [[nodiscard]] std::size_t count() const { return 4 * joints_.size(); }

  [[nodiscard]] std::vector<Slot> of(std::size_t v) const {
    std::vector<Slot> out(count());
    for (std::size_t i = 0; i < out.size(); ++i) {
      const std::uint8_t* joint = &joints_[i / 4]->bytes[8 * v + 2 * (i % 4)];
      out[i] = {static_cast<std::uint16_t>(joint[0] | joint[1] << 8),
                weights_[i / 4]->bytes[4 * v + i % 4]};
    }
    return out;
  }

  void set(std::size_t v, std::span<const Slot> slots) {
    for (std::size_t i = 0; i < slots.size(); ++i) {
      std::uint8_t* joint = &joints_[i / 4]->bytes[8 * v + 2 * (i % 4)];
      joint[0] = static_cast<std::uint8_t>(slots[i].joint & 255);
      joint[1] = static_cast<std::uint8_t>(slots[i].joint >> 8);
      weights_[i / 4]->bytes[4 * v + i % 4] = slots[i].weight;
    }
  }

 private:
  std::vector<VertexStream*> joints_, weights_;
};

/// `own` in the slots of `model`. A joint that `model` lacks takes the free slot that has the least
/// weight there, the last of equal ones.
std::vector<Slot> matched(std::span<const Slot> own, std::span<const Slot> model) {
  std::vector<Slot> out(model.begin(), model.end());
  for (Slot& slot : out) slot.weight = 0;
  std::vector<Slot> left;
  for (const Slot& slot : own) {
    if (slot.weight == 0) continue;
    const auto same = std::find_if(out.begin(), out.end(), [&](const Slot& s) {
      return s.weight == 0 && s.joint == slot.joint;
    });
    if (same == out.end()) {
      left.push_back(slot);
    } else {
      *same = slot;
    }
  }
  for (const Slot& slot : left) {
    std::size_t best = out.size();
    for (std::size_t i = 0; i < out.size(); ++i) {
      if (out[i].weight != 0) continue;
      if (best == out.size() || model[i].weight <= model[best].weight) best = i;
    }
    out[best] = slot;
  }
  return out;
}

}  // namespace

void match_influence_slots(std::span<VertexStream> streams, const decoders::VertexLinks& links) {
  Slots slots(streams);
  if (slots.count() == 0) return;
  const decoders::VertexStreamForm& form = decoders::form_of(Semantic::kJoints);
  for (std::size_t v = 0; v < links.of_vertices.size(); ++v) {
    const decoders::VertexNeighbours& neighbours = links.neighbours(form, v);
    if (links.has_twin(v)) {
      slots.set(v, slots.of(links.twins[v]));
    } else if (neighbours.count > 0) {
      slots.set(v, matched(slots.of(v), slots.of(neighbours.near)));
    }
  }
}

}  // namespace relit::bake
