// SPDX-License-Identifier: MIT
#include <algorithm>

#include "player/measure_page.hpp"
#include "player/measure_plot.hpp"
#include "player/measure_text.hpp"

namespace relit::player {
namespace {

// A column of what was chosen: left out where all points have the same.
struct Choice {
  const char* name;
  std::vector<std::string> values;  // by point
  [[nodiscard]] bool varies() const {
    return std::any_of(values.begin(), values.end(),
                       [this](const std::string& value) { return value != values.front(); });
  }
};

std::vector<Choice> choices_of(const MeasureReport& report) {
  std::vector<Choice> columns{
      {"model", {}},     {"order", {}},     {"texels", {}},      {"codec", {}},  {"bits", {}},
      {"chroma", {}},    {"exponents", {}}, {"prediction", {}},  {"planes", {}}, {"layers", {}},
      {"composite", {}}, {"threads", {}},   {"frames shown", {}}};
  for (const MeasuredPoint& point : report.points) {
    const MeasuredFile& file = report.files[point.file];
    const MeasureKnobs& knobs = point.knobs;
    const std::string exponents = file.exponent_block == 0
                                      ? "none"
                                      : "blocks of " + std::to_string(file.exponent_block) +
                                            ", held " + std::to_string(file.exponent_hold);
    const std::string values[] = {
        file.model,
        std::to_string(file.order),
        std::to_string(file.width) + "×" + std::to_string(file.height),
        file.codec + (file.lossless ? ", lossless" : ""),
        std::to_string(file.bit_depth),
        file.chroma,
        exponents,
        file.prediction ? "yes" : "no",
        std::to_string(knobs.planes) + " of " + std::to_string(file.planes()),
        std::to_string(point.layers) + " of " + std::to_string(file.layers.size()),
        path_label(knobs),
        std::to_string(knobs.threads),
        knobs.every == 1 ? std::string("all") : "1 in " + std::to_string(knobs.every)};
    for (std::size_t c = 0; c < columns.size(); ++c) columns[c].values.push_back(values[c]);
  }
  return columns;
}

std::string cell(const std::string& text, const char* kind = "") {
  return std::string(*kind != 0 ? std::string("<td class=\"") + kind + "\">" : "<td>") +
         html_escape(text) + "</td>";
}

std::string heading(const std::string& text, const std::string& unit = "") {
  return "<th>" + html_escape(text) + (unit.empty() ? "" : "<br/>" + html_escape(unit)) + "</th>";
}

std::string figures_of(const MeasuredPoint& point) {
  const auto mebibytes = [](std::uint64_t bytes) {
    return fixed(static_cast<double>(bytes) / (1 << 20), 1);
  };
  std::string out = cell(fixed(point.light_bytes_per_s / 1000, 1)) +
                    cell(fixed(point.file_bytes_per_s / 1000, 1));
  if (!point.scored())
    return out + "<td class=\"why\" colspan=\"11\">" + html_escape(point.failure) + "</td>";
  return out + cell(fixed(point.error.psnr_db, 2)) + cell(fixed(point.error.log_psnr_db, 2)) +
         cell(fixed(100 * point.error.p99, 2)) + cell(fixed(100 * point.error.largest, 1)) +
         cell(fixed(point.decode_ms, 2)) + cell(fixed(point.upload_ms, 2)) +
         cell(fixed(point.composite_ms, 2)) + cell(fixed(point.draw_ms, 2)) +
         cell(fixed(point.total_ms(), 2)) + cell(mebibytes(point.heap_bytes)) +
         cell(mebibytes(point.gpu_bytes));
}

std::string row(const MeasureReport& report, const std::vector<Choice>& columns, std::size_t i) {
  const MeasuredPoint& point = report.points[i];
  std::string out = "<tr>" + cell(std::to_string(i + 1)) + "<td class=\"left wrap\">" +
                    html_escape(point_label(report, point));
  if (point.on_bytes_front)
    out += "<span class=\"pill\" title=\"fewest bytes for its error\">bytes</span>";
  if (point.on_time_front)
    out += "<span class=\"pill time\" title=\"least time for its error\">time</span>";
  if (point.lost_frames > 0)
    out += "<br/><span class=\"soft\">" + std::to_string(point.lost_frames) +
           " frames lost to damage</span>";
  out += "</td>";
  for (const Choice& column : columns)
    if (column.varies()) out += cell(column.values[i]);
  return out + figures_of(point) + "</tr>\n";
}

}  // namespace

std::string measure_html_table(const MeasureReport& report) {
  const std::vector<Choice> columns = choices_of(report);
  std::string same, head = "<th></th><th class=\"left\">point</th>";
  for (const Choice& column : columns) {
    if (column.varies()) {
      head += heading(column.name);
    } else {
      same += (same.empty() ? "" : " · ") + std::string(column.name) + " " + column.values.front();
    }
  }
  head += heading("light", "kB/s") + heading("file", "kB/s") + heading("PSNR", "dB") +
          heading("log-PSNR", "dB") + heading("p99", "% of peak") + heading("max", "% of peak") +
          heading("decode", "ms") + heading("upload", "ms") + heading("composite", "ms") +
          heading("draw", "ms") + heading("all", "ms") + heading("heap", "MiB") +
          heading("GPU", "MiB");
  std::string out = "<h2>All points</h2>\n";
  if (!same.empty()) out += "<p class=\"soft\">The same for all: " + html_escape(same) + ".</p>\n";
  out += "<div class=\"scroll\"><table><thead><tr>" + head + "</tr></thead><tbody>\n";
  for (std::size_t i = 0; i < report.points.size(); ++i) out += row(report, columns, i);
  return out + "</tbody></table></div>\n";
}

}  // namespace relit::player
