// SPDX-License-Identifier: MIT
#include "player/measure_text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace relit::player {

using nlohmann::ordered_json;

std::string fixed(double value, int digits) {
  if (std::isinf(value)) return value < 0 ? "−∞" : "∞";
  if (std::isnan(value)) return "–";
  std::array<char, 400> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value,
                                 std::chars_format::fixed, digits);
  return {text.data(), end.ptr};
}

std::string fixed(std::optional<double> value, int digits) {
  return value ? fixed(*value, digits) : "–";
}

namespace {

// Columns as people count them; what is not ASCII here has one column a character.
std::size_t columns_of(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

std::string front_mark(const MeasuredPoint& point) {
  return std::string(point.on_bytes_front ? "B" : " ") + (point.on_time_front ? "T" : " ");
}

std::vector<std::string> cells_of(const MeasureReport& report, const MeasuredPoint& point) {
  const auto kilobytes = [](double bytes) { return fixed(bytes / 1000, 1); };
  std::vector<std::string> cells{front_mark(point), point_label(report, point),
                                 kilobytes(point.light_bytes_per_s),
                                 kilobytes(point.file_bytes_per_s)};
  if (!point.scored()) {
    cells.push_back(point.failure);
    return cells;
  }
  cells.insert(cells.end(),
               {fixed(point.error.psnr_db, 2), fixed(point.error.log_psnr_db, 2),
                fixed(100 * point.error.p99, 2), fixed(100 * point.error.largest, 1),
                fixed(point.decode_ms, 2), fixed(point.upload_ms, 2), fixed(point.composite_ms, 2),
                fixed(point.draw_ms, 2), fixed(point.total_ms(), 2),
                fixed(static_cast<double>(point.heap_bytes + point.gpu_bytes) / (1 << 20), 1)});
  if (point.lost_frames > 0) cells.push_back(std::to_string(point.lost_frames) + " frames lost");
  return cells;
}

}  // namespace

std::string measure_table(const MeasureReport& report) {
  std::vector<std::vector<std::string>> rows{{"", "point", "light kB/s", "file kB/s", "PSNR dB",
                                              "log dB", "p99 %", "max %", "decode", "upload", "sum",
                                              "draw", "all ms", "MiB"}};
  for (const MeasuredPoint& point : report.points) rows.push_back(cells_of(report, point));
  const std::size_t count = rows.front().size();
  std::vector<std::size_t> widths(count, 0);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const bool whole = r == 0 || report.points[r - 1].scored();
    for (std::size_t c = 0; c < std::min(rows[r].size(), whole ? count : 4); ++c)
      widths[c] = std::max(widths[c], columns_of(rows[r][c]));
  }
  std::string out;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t c = 0; c < row.size(); ++c) {
      const std::size_t width = c < count ? widths[c] : 0, taken = columns_of(row[c]);
      const std::string pad(width > taken ? width - taken : 0, ' ');
      line += (c == 0 ? "" : "  ") + (c < 2 ? row[c] + pad : pad + row[c]);
    }
    out += line + "\n";
  }
  out +=
      "B, T: no other point has both a smaller error and fewer bytes of light (B), less time (T)\n";
  return out;
}

namespace {

std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

ordered_json number(double value) {
  return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr);
}
ordered_json number(const std::optional<double>& value) {
  return value ? number(*value) : ordered_json(nullptr);
}

ordered_json point_json(const MeasureReport& report, const MeasuredPoint& point) {
  const MeasuredFile& file = report.files[point.file];
  const MeasureKnobs& knobs = point.knobs;
  const bool scored = point.scored();
  const auto figure = [scored](double value) {
    return scored ? number(value) : ordered_json(nullptr);
  };
  ordered_json out;
  out["file"] = file.path;
  out["model"] = file.model;
  out["label"] = point_label(report, point);
  out["order"] = file.order;
  out["width"] = file.width;
  out["height"] = file.height;
  out["codec"] = file.codec;
  out["bit_depth"] = file.bit_depth;
  out["chroma"] = file.chroma;
  out["lossless"] = file.lossless;
  out["exponent_block"] = file.exponent_block;
  out["exponent_hold"] = file.exponent_hold;
  out["prediction"] = file.prediction;
  out["planes"] = knobs.planes;
  out["planes_of"] = file.planes();
  out["layers"] = point.layers;
  out["layers_of"] = file.layers.size();
  out["composite"] = composite_path_name(knobs.path);
  out["backend"] = knobs.backend ? ordered_json(backend_name(*knobs.backend)) : ordered_json();
  out["threads"] = knobs.threads;
  out["every"] = knobs.every;
  out["light_bytes"] = point.light_bytes;
  out["file_bytes"] = point.file_bytes;
  out["light_bytes_per_s"] = number(point.light_bytes_per_s);
  out["file_bytes_per_s"] = number(point.file_bytes_per_s);
  out["psnr_db"] = figure(point.error.psnr_db);
  out["log_psnr_db"] = figure(point.error.log_psnr_db);
  out["p99"] = figure(point.error.p99);
  out["max"] = figure(point.error.largest);
  out["exact"] = scored && std::isinf(point.error.psnr_db);
  out["decode_ms"] = number(point.decode_ms);
  out["upload_ms"] = number(point.upload_ms);
  out["composite_ms"] = number(point.composite_ms);
  out["draw_ms"] = number(point.draw_ms);
  out["total_ms"] = number(point.total_ms());
  out["heap_bytes"] = point.heap_bytes;
  out["gpu_bytes"] = point.gpu_bytes;
  out["lost_frames"] = point.lost_frames;
  out["on_bytes_front"] = point.on_bytes_front;
  out["on_time_front"] = point.on_time_front;
  out["failure"] = scored ? ordered_json() : ordered_json(point.failure);
  return out;
}

std::string csv_cell(const ordered_json& value) {
  if (value.is_null()) return "";
  if (value.is_string()) return quoted(value.get<std::string>());
  return value.dump();
}

}  // namespace

std::string measure_csv(const MeasureReport& report) {
  std::string out;
  for (std::size_t i = 0; i < report.points.size(); ++i) {
    const ordered_json point = point_json(report, report.points[i]);
    std::string header, line;
    for (const auto& [key, value] : point.items()) {
      const bool infinite = point["exact"] == true && (key == "psnr_db" || key == "log_psnr_db");
      header += (header.empty() ? "" : ",") + key;
      line += (key == "file" ? "" : ",") + (infinite ? "inf" : csv_cell(value));
    }
    if (i == 0) out += header + "\r\n";
    out += line + "\r\n";
  }
  return out;
}

ordered_json measure_json(const MeasureReport& report) {
  ordered_json out;
  out["schema"] = "relit-measure";
  out["schema_version"] = 1;
  out["command"] = report.command;
  const MeasuredMachine& machine = report.machine;
  out["machine"] = {{"cpu", machine.cpu},
                    {"cores", machine.cores},
                    {"system", machine.system},
                    {"version", machine.version},
                    {"gl", ordered_json::array()}};
  for (const MeasuredMachine::Gl& gl : machine.gl)
    out["machine"]["gl"].push_back(
        {{"backend", gl.backend}, {"renderer", gl.renderer}, {"version", gl.version}});
  out["reference"] = {
      {"file", report.reference},          {"baked", report.reference_baked},
      {"frames", report.reference_frames}, {"coefficients", report.reference_coefficients},
      {"width", report.reference_width},   {"height", report.reference_height},
      {"peak", number(report.peak)},       {"scored_frames", report.scored_frames}};
  out["lights"] = report.lights;
  out["points"] = ordered_json::array();
  for (const MeasuredPoint& point : report.points)
    out["points"].push_back(point_json(report, point));
  return out;
}

}  // namespace relit::player
