// SPDX-License-Identifier: MIT
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "media/figure.hpp"
#include "media/lights.hpp"

namespace {

namespace fs = std::filesystem;
using relit::media::Figure;

void save(const fs::path& path, const std::vector<std::uint8_t>& bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) throw std::runtime_error(path.string() + ": cannot be written");
  std::fprintf(stderr, "%s: %zu bytes\n", path.string().c_str(), bytes.size());
}

void generate(const fs::path& folder) {
  fs::create_directories(folder / "lights");
  for (const auto& panorama : relit::media::make_panoramas()) {
    save(folder / "lights" / (panorama.name + ".hdr"), relit::media::write_hdr(panorama));
  }
  const Figure figure = relit::media::make_figure();
  std::size_t triangles = 0;
  for (const auto& patch : figure.patches) triangles += patch.triangles.size();
  std::fprintf(
      stderr,
      "mannequin: %zu triangles in %zu charts, %.1f %% of the atlas, %.1f texels/m at 128\n",
      triangles, figure.patches.size(), 100.0 * figure.coverage, figure.texels_per_metre);
  save(folder / "mannequin.glb", relit::media::write_glb(figure, relit::media::make_wood_png()));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 || std::string(argv[1]).starts_with("-")) {
    std::fprintf(
        stderr, "usage: relit-media OUTDIR\nwrites OUTDIR/mannequin.glb and OUTDIR/lights/*.hdr\n");
    return 2;
  }
  try {
    generate(argv[1]);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "relit-media: %s\n", e.what());
    return 2;
  }
  return 0;
}
