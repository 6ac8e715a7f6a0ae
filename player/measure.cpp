// SPDX-License-Identifier: MIT
#include "player/measure.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numeric>

namespace relit::player {

int MeasuredFile::planes() const {
  int count = 0;
  for (const Layer& layer : layers) count += layer.planes;
  return count;
}

std::size_t MeasuredFile::layers_for(int planes) const {
  int count = 0;
  std::size_t l = 0;
  for (; l < layers.size() && count < planes; ++l) count += layers[l].planes;
  return l;
}

double MeasuredPoint::total_ms() const {
  double sum = 0;
  for (const std::optional<double>& ms : {decode_ms, upload_ms, composite_ms, draw_ms})
    sum += ms.value_or(0);
  return sum;
}

std::string path_label(const MeasureKnobs& knobs) {
  std::string label = composite_path_name(knobs.path);
  if (knobs.path != CompositePath::kCpu && knobs.backend)
    label += std::string(" on ") + backend_name(*knobs.backend);
  return label;
}

std::string point_label(const MeasureReport& report, const MeasuredPoint& point) {
  const MeasuredFile& file = report.files[point.file];
  std::string label =
      report.files.size() > 1 ? std::filesystem::path(file.path).stem().string() : "";
  const auto add = [&label](const std::string& what) {
    label += (label.empty() ? "" : ", ") + what;
  };
  const MeasureKnobs& knobs = point.knobs;
  if (knobs.planes < file.planes())
    add(std::to_string(knobs.planes) + (knobs.planes == 1 ? " plane" : " planes"));
  if (knobs.path != CompositePath::kCpu) add(path_label(knobs));
  if (knobs.threads > 1) add(std::to_string(knobs.threads) + " threads");
  if (knobs.every > 1) add("1 frame in " + std::to_string(knobs.every));
  return label.empty() ? "all planes" : label;
}

std::vector<std::uint8_t> pareto_front(std::span<const double> costs,
                                       std::span<const double> gains) {
  std::vector<std::size_t> order(costs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::erase_if(order,
                [&](std::size_t i) { return !std::isfinite(costs[i]) || std::isnan(gains[i]); });
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    if (costs[a] != costs[b]) return costs[a] < costs[b];
    return gains[a] != gains[b] ? gains[a] > gains[b] : a < b;
  });
  std::vector<std::uint8_t> front(costs.size(), 0);
  std::optional<std::size_t> last;
  for (const std::size_t i : order) {
    if (last && gains[i] <= gains[*last]) continue;
    front[i] = 1;
    last = i;
  }
  return front;
}

void mark_fronts(std::vector<MeasuredPoint>& points) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> bytes, times, gains;
  for (const MeasuredPoint& point : points) {
    bytes.push_back(point.light_bytes_per_s);
    times.push_back(point.decode_ms && point.composite_ms ? point.total_ms() : kNone);
    gains.push_back(point.scored() ? point.error.psnr_db : kNone);
  }
  const auto by_bytes = pareto_front(bytes, gains), by_time = pareto_front(times, gains);
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].on_bytes_front = by_bytes[i] != 0;
    points[i].on_time_front = by_time[i] != 0;
  }
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 != 0 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
}

}  // namespace relit::player
