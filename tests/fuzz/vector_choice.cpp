// SPDX-License-Identifier: MIT
#include "tests/fuzz/vector_choice.hpp"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

namespace relit::fuzz {

namespace fs = std::filesystem;

std::vector<fs::path> relit_files(const fs::path& folder) {
  std::vector<fs::path> files;
  if (!fs::is_directory(folder)) return files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.path().extension() == ".relit") files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

bool VectorChoice::is_new(const fs::path& vector) {
  std::ifstream in(fs::path(vector).replace_extension(".json"));
  const auto json = nlohmann::json::parse(in, nullptr, false);
  if (!json.is_object()) return true;
  bool fresh = false;
  for (const auto& id : json.value("findings", nlohmann::json::array()))
    fresh |= findings_.insert(id.get<std::string>()).second;
  const std::string name = vector.stem().string();
  fresh |= outcomes_.emplace(name.substr(0, name.find('-')), json.value("outcome", "")).second;
  return fresh;
}

}  // namespace relit::fuzz
