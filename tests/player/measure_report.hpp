// SPDX-License-Identifier: MIT
#pragma once

#include "player/measure.hpp"

namespace relit::player::test {

/// Two files and four points, one of them not scored, with names that hurt who does not escape.
inline MeasureReport sample_report() {
  MeasureReport report;
  report.command = {"relit", "measure", "a <b> & \"c\".relit", "it's.relit"};
  report.machine = {"CPU <1> & co", "Linux", "relit 1", 2, {{"egl", "soft <pipe>", "ES 3"}}};
  report.reference = "a <b> & \"c\".npy";
  report.reference_baked = true;
  report.reference_frames = 10, report.reference_coefficients = 9;
  report.reference_width = report.reference_height = 128;
  report.peak = 1.5;
  report.scored_frames = {0, 5};
  report.lights = {"noon", "dusk"};
  for (const char* path : {"in/a <b> & \"c\".relit", "in/it's, too.relit"}) {
    MeasuredFile file;
    file.path = path, file.clip = "walk", file.model = "shlm", file.codec = "h264";
    file.chroma = "luma", file.order = 2, file.width = file.height = 128, file.bit_depth = 10;
    file.frames = file.ticks = 10, file.duration_s = 0.5, file.prediction = true;
    file.layers = {{1, 1000}, {4, 3000}};
    report.files.push_back(file);
  }
  const auto add = [&](std::size_t file, int planes, double bytes, double psnr, double ms) {
    MeasuredPoint& point = report.points.emplace_back();
    point.file = file, point.knobs.planes = planes;
    point.layers = report.files[file].layers_for(planes);
    point.light_bytes_per_s = bytes, point.file_bytes_per_s = bytes + 5000;
    point.light_bytes = static_cast<std::uint64_t>(bytes / 2);
    point.error.psnr_db = psnr, point.error.log_psnr_db = psnr - 3;
    point.error.p99 = 0.01, point.error.largest = 0.1;
    point.decode_ms = ms, point.upload_ms = 0.25, point.composite_ms = 0.5;
    point.heap_bytes = 3 << 20, point.gpu_bytes = 1 << 20;
  };
  add(0, 5, 8000, 40, 2);
  add(0, 1, 2000, 30, 1);
  add(1, 5, 9000, 39, 3);
  add(1, 1, 2000, 29, 1);
  report.points.back().failure = "not <possible>";
  mark_fronts(report.points);
  return report;
}

}  // namespace relit::player::test
