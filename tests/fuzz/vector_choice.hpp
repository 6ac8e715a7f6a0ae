// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace relit::fuzz {

/// All .relit files of a folder, in the order of their names.
std::vector<std::filesystem::path> relit_files(const std::filesystem::path& folder);

/// Says of conformance vectors, taken in their order, which one shows something that none before
/// it did: a finding, or another outcome of its family (the first word of its name). The rest would
/// keep a fuzzer busy with executing its seeds.
class VectorChoice {
 public:
  /// True where no readable JSON stands beside the file.
  bool is_new(const std::filesystem::path& vector);

 private:
  std::set<std::string> findings_;
  std::set<std::pair<std::string, std::string>> outcomes_;  ///< family, outcome
};

}  // namespace relit::fuzz
