// SPDX-License-Identifier: MIT
#include "player/measure_pictures.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "decoders/png_encoder.hpp"

namespace relit::player {
namespace {

constexpr int kSide = 800;  // pixels of what is drawn; what is kept of it is cropped
using Map = std::vector<float>;

// Threads cannot be seen, and what a fused sum gives is read as the same sum in texture space.
bool looks_alike(const MeasuredPoint& a, const MeasuredPoint& b) {
  return a.file == b.file && a.knobs.planes == b.knobs.planes && a.knobs.every == b.knobs.every &&
         path_label(a.knobs) == path_label(b.knobs);
}

Result<Map> light_map_of(const MeasuredFile& file, const MeasureKnobs& knobs, std::uint64_t tick,
                         const decoders::Light& light) {
  Map map(std::size_t{3} * static_cast<std::size_t>(file.width) *
          static_cast<std::size_t>(file.height));
  const auto work = [&]() -> Status {
    GlBackend gl;
    if (knobs.path != CompositePath::kCpu) {
      RELIT_ASSIGN(gl, open_backend(*knobs.backend));
    }
    RELIT_ASSIGN(TickFrames frames, open_point(file, knobs));
    RELIT_ASSIGN(const auto relighter, relighter_for(frames.reader(), knobs, gl.device.get()));
    RELIT_TRY(relighter->set_light(light));
    RELIT_ASSIGN(const FrameMix mix, frames.at(tick));
    RELIT_TRY(relighter->composite(mix));
    return relighter->read(map);
  };
  RELIT_TRY(on_own_thread(work));
  return map;
}

Map composite(std::span<const float> transfer, const decoders::Light& light,
              std::size_t coefficients) {
  const std::size_t texels = transfer.size() / (3 * coefficients);
  Map map(3 * texels);
  for (std::size_t n = 0; n < std::min(coefficients, light.sh.size()); ++n) {
    for (std::size_t c = 0; c < 3; ++c) {
      const auto weight = static_cast<float>(light.sh[n][c]);
      for (std::size_t p = 0; p < texels; ++p)
        map[c * texels + p] += weight * transfer[(3 * n + c) * texels + p];
    }
  }
  return map;
}

struct Lit {
  Map map;
  int width = 0, height = 0;
};

// A rectangle of a picture of kSide².
struct Crop {
  int x0 = kSide, y0 = kSide, x1 = 0, y1 = 0;
  [[nodiscard]] bool empty() const { return x0 >= x1; }
};

// What is not transparent, and some room around it.
Crop crop_of(std::span<const std::uint8_t> rgba) {
  Crop crop;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      if (rgba[static_cast<std::size_t>(4 * (y * kSide + x) + 3)] == 0) continue;
      crop.x0 = std::min(crop.x0, x), crop.x1 = std::max(crop.x1, x + 1);
      crop.y0 = std::min(crop.y0, y), crop.y1 = std::max(crop.y1, y + 1);
    }
  }
  constexpr int kRoom = kSide / 50;
  if (crop.empty()) return {0, 0, kSide, kSide};
  return {std::max(crop.x0 - kRoom, 0), std::max(crop.y0 - kRoom, 0),
          std::min(crop.x1 + kRoom, kSide), std::min(crop.y1 + kRoom, kSide)};
}

Result<std::vector<std::uint8_t>> encode(std::span<const std::uint8_t> rgba, const Crop& crop) {
  const int width = crop.x1 - crop.x0, height = crop.y1 - crop.y0;
  std::vector<std::uint8_t> kept;
  for (int y = crop.y0; y < crop.y1; ++y) {
    const auto row = rgba.subspan(static_cast<std::size_t>(4 * (y * kSide + crop.x0)),
                                  static_cast<std::size_t>(4 * width));
    kept.insert(kept.end(), row.begin(), row.end());
  }
  return decoders::encode_png(width, height, kept);
}

}  // namespace

std::vector<std::size_t> picture_points(const MeasureReport& report, std::size_t most) {
  std::vector<std::size_t> chosen;
  const auto take = [&](const auto& wanted) {
    for (std::size_t i = 0; i < report.points.size() && chosen.size() < most; ++i) {
      const MeasuredPoint& point = report.points[i];
      if (!point.scored() || point.knobs.path == CompositePath::kFused || !wanted(point)) continue;
      if (std::none_of(chosen.begin(), chosen.end(),
                       [&](std::size_t other) { return looks_alike(report.points[other], point); }))
        chosen.push_back(i);
    }
  };
  take([](const MeasuredPoint& point) { return point.on_bytes_front; });
  take([](const MeasuredPoint&) { return true; });
  std::stable_sort(chosen.begin(), chosen.end(), [&](std::size_t a, std::size_t b) {
    return report.points[a].error.psnr_db > report.points[b].error.psnr_db;
  });
  return chosen;
}

void draw_difference(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b, double gain,
                     std::span<std::uint8_t> out) {
  constexpr std::array<std::uint8_t, 3> kInk{214, 40, 90}, kSilhouette{128, 128, 136};
  constexpr double kFaint = 0.16;
  for (std::size_t i = 0; i + 3 < out.size(); i += 4) {
    int apart = 0;
    for (std::size_t c = 0; c < 3; ++c) apart = std::max(apart, std::abs(int{a[i + c]} - b[i + c]));
    const double opaque = std::max(a[i + 3], b[i + 3]) / 255.0;
    const double ink = opaque * std::min(gain * apart / 255, 1.0);
    const double alpha = ink + (1 - ink) * kFaint * opaque;
    for (std::size_t c = 0; c < 3; ++c) {
      const double mixed = alpha > 0 ? (ink * kInk[c] + (alpha - ink) * kSilhouette[c]) / alpha : 0;
      out[i + c] = static_cast<std::uint8_t>(std::lround(mixed));
    }
    out[i + 3] = static_cast<std::uint8_t>(std::lround(255 * alpha));
  }
}

Status add_pictures(const MeasureReference& reference, std::span<const MeasureLight> lights,
                    Backend backend, std::size_t most, MeasureReport& report) {
  const auto& ticks = reference.ticks();
  const auto at = std::find(ticks.begin(), ticks.end(), report.picture_frame);
  if (at == ticks.end())
    return fail(ErrorCode::kInvalid, "frame " + std::to_string(report.picture_frame) +
                                         " of the reference is not loaded");
  const decoders::Light& light = lights.front().light;
  const std::vector<std::size_t> chosen = picture_points(report, most);
  const decoders::MapSize size = reference.shape().size;
  std::vector<Lit> lit;
  lit.push_back({composite(reference.transfer(static_cast<std::size_t>(at - ticks.begin())), light,
                           static_cast<std::size_t>(reference.shape().coefficients())),
                 static_cast<int>(size.width), static_cast<int>(size.height)});
  for (const std::size_t i : chosen) {
    const MeasuredFile& file = report.files[report.points[i].file];
    RELIT_ASSIGN(Map map, light_map_of(file, report.points[i].knobs, report.picture_frame, light));
    lit.push_back({std::move(map), file.width, file.height});
  }
  std::vector<std::vector<std::uint8_t>> pictures;
  const auto draw = [&]() -> Status {
    const MeasuredFile& file = report.files.front();
    RELIT_ASSIGN(TickFrames frames, TickFrames::open(file.path, {file.clip, -1, 1}));
    RELIT_ASSIGN(const auto stage, MeasureStage::create(backend, frames.reader(), {kSide, 4}));
    stage->expose(light);
    RELIT_ASSIGN(const FrameMix mix, frames.at(report.picture_frame));
    RELIT_TRY(stage->pose(mix));
    for (const Lit& one : lit) {
      RELIT_TRY(stage->draw(one.map, one.width, one.height));
      RELIT_ASSIGN(auto rgba, stage->read());
      pictures.push_back(std::move(rgba));
    }
    return {};
  };
  RELIT_TRY(on_own_thread(draw));
  report.picture_light = lights.front().name;
  // All are posed alike.
  const Crop crop = crop_of(pictures.front());
  RELIT_ASSIGN(report.reference_png, encode(pictures.front(), crop));
  std::vector<std::uint8_t> difference(pictures.front().size());
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    MeasuredPicture& picture = report.pictures.emplace_back();
    picture.point = chosen[i];
    RELIT_ASSIGN(picture.png, encode(pictures[i + 1], crop));
    draw_difference(pictures.front(), pictures[i + 1], report.difference_gain, difference);
    RELIT_ASSIGN(picture.difference_png, encode(difference, crop));
  }
  return {};
}

}  // namespace relit::player
