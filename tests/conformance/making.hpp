// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "tests/conformance/figure.hpp"
#include "tests/conformance/vector.hpp"

/// Vectors as changes to a good file, at three depths.
namespace relit::conformance {

inline constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// What is expected of a vector besides its name.
struct Expect {
  Outcome outcome = Outcome::kWhole;
  std::vector<std::string> findings = {};
  bool valid = true;
  bool decodes = true;
};

inline Expect whole() { return {}; }
/// Readable and within the rules, but worth a word.
inline Expect noted(std::vector<std::string> findings) {
  return {Outcome::kWhole, std::move(findings), true, true};
}
/// Breaks a rule that a reader need not notice, or makes up for.
inline Expect faulty(std::vector<std::string> findings) {
  return {Outcome::kWhole, std::move(findings), false, true};
}
/// The records are fine, what they hold does not decode.
inline Expect undecodable(std::vector<std::string> findings) {
  return {Outcome::kWhole, std::move(findings), false, false};
}
inline Expect lossy(std::vector<std::string> findings) {
  return {Outcome::kLossy, std::move(findings), false, true};
}
inline Expect refused(std::vector<std::string> findings) {
  return {Outcome::kRefused, std::move(findings), false, false};
}

inline void add(Vectors& vectors, std::string name, std::string description, Expect expect,
                std::function<Bytes()> make) {
  vectors.push_back({std::move(name), std::move(description), expect.outcome,
                     std::move(expect.findings), std::move(make), expect.valid, expect.decodes});
}

/// Changes structures, of which index, sizes, copies and checksums then follow.
inline void from_draft(Vectors& vectors, std::string name, std::string description, Expect expect,
                       std::function<void(Draft&)> change,
                       const FigureOptions& options = plain_figure()) {
  add(vectors, std::move(name), std::move(description), std::move(expect), [change, options] {
    Draft draft = figure(options);
    change(draft);
    return assemble(draft);
  });
}

/// Changes payloads, flags and the order of records; checksums follow.
inline void from_pieces(Vectors& vectors, std::string name, std::string description, Expect expect,
                        std::function<void(std::vector<Piece>&)> change) {
  add(vectors, std::move(name), std::move(description), std::move(expect), [change] {
    std::vector<Piece> pieces = pieces_of(figure());
    change(pieces);
    return assemble(pieces);
  });
}

/// Changes the finished file.
inline void from_bytes(Vectors& vectors, std::string name, std::string description, Expect expect,
                       std::function<void(Bytes&)> change) {
  add(vectors, std::move(name), std::move(description), std::move(expect), [change] {
    Bytes bytes = assemble(figure());
    change(bytes);
    return bytes;
  });
}

/// A file that ends behind its static part, whose contents are to be refused for `finding`: nothing
/// of what follows would be read.
inline void from_static_draft(Vectors& vectors, std::string name, std::string description,
                              std::string finding, std::function<void(Draft&)> change,
                              const FigureOptions& options = plain_figure()) {
  from_draft(
      vectors, std::move(name), std::move(description),
      refused({std::move(finding), "FEND_MISSING"}),
      [change](Draft& draft) {
        draft.segments.clear();
        draft.copies = draft.index = draft.end = false;
        change(draft);
      },
      options);
}

/// The payloads of a type, copies included.
inline void each_payload(std::vector<Piece>& pieces, container::RecordType type,
                         const std::function<void(Bytes&)>& change) {
  for (Piece& piece : pieces) {
    if (piece.type == type) change(piece.payload);
  }
}

}  // namespace relit::conformance
