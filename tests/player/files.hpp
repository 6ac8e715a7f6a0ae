// SPDX-License-Identifier: MIT
#pragma once

#include <stdlib.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/places.hpp"

/// Files that the player's tests share: the clip and lights that ship with relit, and a folder to
/// write to.
namespace relit::player::test {

using relit::test::source_dir;
inline std::filesystem::path shipped_clip() { return source_dir() / "media/mannequin.relit"; }
inline std::filesystem::path shipped_light() {
  return source_dir() / "media/lights/studio_soft.hdr";
}

struct Folder {
  std::filesystem::path path;
  Folder() {
    std::string name =
        (std::filesystem::temp_directory_path() / "relit-player-test-XXXXXX").string();
    path = ::mkdtemp(name.data());
  }
  ~Folder() { std::filesystem::remove_all(path); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  [[nodiscard]] std::string file(const char* name) const { return (path / name).string(); }
};

inline std::vector<std::uint8_t> read_bytes(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Runs `relit ARGUMENTS` and returns its exit status; what it says goes to `says`.
inline int run_relit(const std::string& arguments, std::string* says = nullptr) {
  const Folder folder;
  const std::string binary = (relit::test::binary_dir() / "bin/relit").string();
  const int status =
      std::system((binary + " " + arguments + " >" + folder.file("out") + " 2>&1").c_str());
  if (says != nullptr) {
    const auto bytes = read_bytes(folder.file("out"));
    says->assign(bytes.begin(), bytes.end());
  }
  return WEXITSTATUS(status);
}

}  // namespace relit::player::test
