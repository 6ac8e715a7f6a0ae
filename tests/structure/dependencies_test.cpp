// SPDX-License-Identifier: MIT
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/test.hpp"

namespace fs = std::filesystem;

namespace {

// container <- decoders <- player -> gles; bake_minimal -> decoders, container; all ->
// container/base.
const std::map<std::string, std::set<std::string>> kMayInclude{
    {"container", {"container"}},
    {"decoders", {"container", "decoders"}},
    {"gles", {"container/base", "gles"}},
    {"player", {"container", "decoders", "gles", "player"}},
    {"bake_minimal", {"container", "decoders", "bake_minimal"}},
    {"media", {"media"}},
};

struct Include {
  std::string target;
  bool quoted;
};

std::vector<Include> includes_of(const fs::path& file) {
  static const std::regex kInclude(R"re(^\s*#\s*include\s*(["<])([^">]+)[">])re");
  std::ifstream in(file);
  std::vector<Include> found;
  std::smatch match;
  for (std::string line; std::getline(in, line);) {
    if (std::regex_search(line, match, kInclude)) found.push_back({match[2], match[1] == "\""});
  }
  return found;
}

bool allowed(const std::string& folder, const std::string& target) {
  for (const std::string& prefix : kMayInclude.at(folder)) {
    if (target.rfind(prefix + "/", 0) == 0) return true;
  }
  return false;
}

fs::path source_dir() {
  const char* dir = std::getenv("RELIT_SOURCE_DIR");
  return dir != nullptr ? fs::path(dir) : fs::current_path();
}

std::vector<fs::path> sources_of(const std::string& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(source_dir() / folder)) {
    const std::string extension = entry.path().extension().string();
    if (extension == ".cpp" || extension == ".hpp" || extension == ".h" || extension == ".c")
      files.push_back(entry.path());
  }
  return files;
}

}  // namespace

TEST_CASE("folders include only the folders they may know") {
  for (const auto& [folder, unused] : kMayInclude) {
    const std::vector<fs::path> files = sources_of(folder);
    CHECK(!files.empty());
    for (const fs::path& file : files) {
      for (const Include& include : includes_of(file)) {
        if (!include.quoted) continue;
        INFO(file.string() << " includes \"" << include.target << "\"");
        CHECK(allowed(folder, include.target));
      }
    }
  }
}

TEST_CASE("the check notices a breach") {
  CHECK_FALSE(allowed("gles", "decoders/sh.hpp"));
  CHECK_FALSE(allowed("gles", "container/records.hpp"));
  CHECK_FALSE(allowed("decoders", "gles/device.hpp"));
  CHECK_FALSE(allowed("container", "decoders/mesh.hpp"));
  CHECK_FALSE(allowed("player", "bake_minimal/scene.hpp"));
  CHECK(allowed("gles", "container/base/plane_view.hpp"));
}

TEST_CASE("the runtime includes no library of the bake side, and only the window knows SDL") {
  const std::regex bake("embree|Eigen|tiny_gltf|stb_rect_pack");
  for (const char* folder : {"container", "decoders", "gles", "player"}) {
    for (const fs::path& file : sources_of(folder)) {
      for (const Include& include : includes_of(file)) {
        INFO(file.string() << " includes " << include.target);
        CHECK_FALSE(std::regex_search(include.target, bake));
        // Examples are hosts of their own.
        const bool example = file.parent_path().filename() == "examples";
        if (!example && include.target.find("SDL") != std::string::npos) {
          CHECK(file.filename().string().find("window") != std::string::npos);
        }
      }
    }
  }
}

TEST_CASE("every source names its licence in its first line") {
  for (const char* folder :
       {"container", "decoders", "gles", "player", "bake_minimal", "media", "tests"}) {
    for (const fs::path& file : sources_of(folder)) {
      std::ifstream in(file);
      std::string line;
      std::getline(in, line);
      INFO(file.string());
      CHECK(line.find("SPDX-License-Identifier: MIT") != std::string::npos);
    }
  }
}
