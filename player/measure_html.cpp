// SPDX-License-Identifier: MIT
#include "player/measure_html.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "player/measure_machine.hpp"
#include "player/measure_page.hpp"
#include "player/measure_plot.hpp"
#include "player/measure_text.hpp"

namespace relit::player {

std::string base64(std::span<const std::uint8_t> bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(bytes.size() - i, 3);
    unsigned group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < count ? bytes[i + k] : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      out += k <= count ? kDigits[group >> (18 - 6 * k) & 63u] : '=';
  }
  return out;
}

namespace {

std::string file_name(const std::string& path) {
  return std::filesystem::path(path).filename().string();
}

std::string element(const std::string& name, const std::string& escaped) {
  return "<" + name + ">" + escaped + "</" + name.substr(0, name.find(' ')) + ">\n";
}

// What a series stands for: of several files their codec, of one file which knob was turned.
std::string series_of(const MeasureReport& report, const MeasuredPoint& point) {
  const MeasuredFile& file = report.files[point.file];
  if (report.files.size() > 1) {
    std::string name = file.model + ", " + file.codec;
    if (file.bit_depth != 0) name += " " + std::to_string(file.bit_depth) + "-bit";
    return name;
  }
  if (point.knobs.every > 1) return "frames left out";
  if (point.knobs.path != CompositePath::kCpu) return "composited on the GPU";
  if (point.knobs.threads > 1) return "more threads";
  if (point.knobs.planes < file.planes()) return "planes left out";
  return "everything, on the CPU";
}

// The series in the order in which they come up; what is more than there are colours shares the
// last one.
class Series {
 public:
  explicit Series(const MeasureReport& report) {
    for (const MeasuredPoint& point : report.points) {
      const std::string name = series_of(report, point);
      if (std::find(names_.begin(), names_.end(), name) == names_.end()) names_.push_back(name);
    }
  }
  [[nodiscard]] int of(const std::string& name) const {
    const auto at = std::find(names_.begin(), names_.end(), name) - names_.begin();
    return static_cast<int>(std::min<std::ptrdiff_t>(at, kPlotSeries - 1));
  }
  [[nodiscard]] std::string legend() const {
    std::string out = "<ul class=\"legend\">";
    for (const std::string& name : names_)
      out += "<li>" + plot_mark(of(name)) + html_escape(name) + "</li>";
    return out + "<li>filled, dashed line: no other point is better in both</li></ul>\n";
  }

 private:
  std::vector<std::string> names_;
};

std::string wide_and_narrow(const std::string& wide, const std::string& narrow) {
  return "<div class=\"wide\">" + wide + "</div><div class=\"narrow\">" + narrow + "</div>\n";
}

std::string scatter(const MeasureReport& report, const Series& series, bool by_time) {
  std::vector<PlotPoint> points;
  for (std::size_t i = 0; i < report.points.size(); ++i) {
    const MeasuredPoint& point = report.points[i];
    const double x = by_time ? point.total_ms() : point.light_bytes_per_s / 1000;
    if (!point.scored() || !(x > 0) || std::isnan(point.error.psnr_db)) continue;
    PlotPoint p;
    p.x = x, p.y = point.error.psnr_db;
    p.label = point_label(report, point);
    p.number = std::to_string(i + 1);
    p.hint = p.number + ": " + p.label + " · " + fixed(p.y, 2) + " dB · " + fixed(x, 2) +
             (by_time ? " ms" : " kB/s");
    p.series = series.of(series_of(report, point));
    p.front = by_time ? point.on_time_front : point.on_bytes_front;
    points.push_back(std::move(p));
  }
  if (points.empty()) return element("p class=\"soft\"", "No point was scored.");
  PlotOptions options;
  options.y_title = "relit PSNR, dB";
  options.x_title = by_time ? "milliseconds a frame, logarithmic" : "light, kB/s, logarithmic";
  const std::string wide = scatter_plot(points, options);
  options.width = 340, options.height = 360;
  return wide_and_narrow(wide, scatter_plot(points, options));
}

std::string memory(const MeasureReport& report) {
  std::vector<PlotBar> bars;
  for (const MeasuredPoint& point : report.points) {
    if (!point.scored()) continue;
    const PlotBar bar{point_label(report, point), static_cast<double>(point.heap_bytes) / (1 << 20),
                      static_cast<double>(point.gpu_bytes) / (1 << 20)};
    const bool same = std::any_of(bars.begin(), bars.end(), [&](const PlotBar& other) {
      return other.first == bar.first && other.second == bar.second;
    });
    if (!same) bars.push_back(bar);
  }
  return wide_and_narrow(bar_plot(bars, 1040, "MiB of memory"),
                         bar_plot(bars, 340, "MiB of memory")) +
         "<ul class=\"legend\"><li><span class=\"swatch\" style=\"background:var(--s0)\"></span>"
         "heap</li><li><span class=\"swatch\" "
         "style=\"background:var(--s1)\"></span>GPU</li></ul>\n";
}

std::string image(std::span<const std::uint8_t> png, const std::string& what) {
  return "<img alt=\"" + html_escape(what) + "\" src=\"data:image/png;base64," + base64(png) +
         "\"/>";
}

std::string pictures(const MeasureReport& report) {
  if (report.reference_png.empty()) return "";
  std::string out = element("h2", "Pictures");
  out +=
      element("p class=\"soft\"",
              "Frame " + std::to_string(report.picture_frame) + " under " +
                  html_escape(report.picture_light) +
                  ", each drawn alike but for its light map. Beside it, how far it is from the "
                  "reference: red ink, " +
                  fixed(report.difference_gain, 0) + " times the difference of displayed values.");
  out += "<div class=\"pictures\">\n<figure><div class=\"pair\">" +
         image(report.reference_png, "the reference") +
         "</div><figcaption><strong>Reference</strong>" + html_escape(file_name(report.reference)) +
         "</figcaption></figure>\n";
  for (const MeasuredPicture& picture : report.pictures) {
    const MeasuredPoint& point = report.points[picture.point];
    const std::string label = point_label(report, point);
    out += "<figure><div class=\"pair\">" + image(picture.png, label) +
           image(picture.difference_png, "difference of " + label) + "</div><figcaption><strong>" +
           html_escape(label) + "</strong>" + fixed(point.error.psnr_db, 1) + " dB · " +
           fixed(point.light_bytes_per_s / 1000, 1) + " kB/s</figcaption></figure>\n";
  }
  return out + "</div>\n";
}

std::string list_item(const std::string& what, const std::string& value) {
  return "<dt>" + html_escape(what) + "</dt><dd>" + html_escape(value) + "</dd>\n";
}

std::string how(const MeasureReport& report) {
  const MeasuredMachine& machine = report.machine;
  std::string out = element("h2", "How it was measured") + "<dl>\n";
  out += list_item("processor", machine.cpu + ", " + std::to_string(machine.cores) +
                                    (machine.cores == 1 ? " core" : " cores"));
  out += list_item("system", machine.system);
  for (const MeasuredMachine::Gl& gl : machine.gl)
    out += list_item(gl.backend, gl.renderer + ", " + gl.version);
  if (machine.gl.empty()) out += list_item("GL", "none: nothing was drawn");
  out += list_item("program", machine.version);
  out += list_item("reference",
                   report.reference +
                       (report.reference_baked ? ": the unquantised bake"
                                               : ": all planes of the file, in double precision") +
                       ", " + std::to_string(report.reference_frames) + " frames, " +
                       std::to_string(report.reference_coefficients) + " coefficients, " +
                       std::to_string(report.reference_width) + "×" +
                       std::to_string(report.reference_height) + " texels");
  out += list_item("scored", std::to_string(report.scored_frames.size()) + " of " +
                                 std::to_string(report.reference_frames) + " frames under " +
                                 std::to_string(report.lights.size()) +
                                 (report.lights.size() == 1 ? " light" : " lights"));
  out += list_item("peak", fixed(report.peak, 4) +
                               ", the 99.9th percentile of what the reference "
                               "shines with");
  return out + "</dl>\n<pre>" + html_escape(shell_text(report.command)) + "</pre>\n";
}

std::string title_of(const MeasureReport& report) {
  const std::string first = file_name(report.files.front().path);
  if (report.files.size() == 1) return "The trade: " + first;
  return "The trade: " + std::to_string(report.files.size()) + " files";
}

// The range that the points span.
std::string lead(const MeasureReport& report) {
  std::vector<double> bytes, errors;
  for (const MeasuredPoint& point : report.points) {
    if (!point.scored()) continue;
    bytes.push_back(point.light_bytes_per_s / 1000);
    errors.push_back(point.error.psnr_db);
  }
  if (bytes.empty()) return "";
  const auto [least, most] = std::minmax_element(bytes.begin(), bytes.end());
  const auto [worst, best] = std::minmax_element(errors.begin(), errors.end());
  return element(
      "p class=\"lead\"",
      std::to_string(bytes.size()) + " ways to code and play one character, from " +
          fixed(*least, 1) + " to " + fixed(*most, 1) + " kB/s of light and from " +
          fixed(*worst, 1) + " to " + fixed(*best, 1) + " dB of relit PSNR against " +
          (report.reference_baked ? "the unquantised bake" : "the whole file, decoded exactly") +
          ", under " + std::to_string(report.lights.size()) +
          (report.lights.size() == 1 ? " light." : " lights."));
}

}  // namespace

std::string measure_html(const MeasureReport& report) {
  const Series series(report);
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/>\n<meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\"/>\n";
  out += element("title", html_escape(title_of(report)));
  out += "<style>\n" + std::string(kMeasurePageStyle) + "</style></head>\n<body><main>\n";
  out += element("h1", html_escape(title_of(report))) + lead(report);
  out += element("h2", "Error against bytes");
  out +=
      "<figure><figcaption>Bytes of the layers that are used, for each second of the clip. Up "
      "and to the left is better.</figcaption>" +
      scatter(report, series, false) + series.legend() + "</figure>\n";
  out += element("h2", "Error against time");
  out +=
      "<figure><figcaption>Decoding, upload, composite and drawing of one frame, one after the "
      "other. Up and to the left is better.</figcaption>" +
      scatter(report, series, true) + series.legend() + "</figure>\n";
  out += element("h2", "Memory");
  out +=
      "<figure><figcaption>MiB, by the account of <code>relit plan</code>: the largest that "
      "playing takes at once.</figcaption>" +
      memory(report) + "</figure>\n";
  out += pictures(report) + measure_html_table(report) + how(report);
  return out + "</main></body></html>\n";
}

}  // namespace relit::player
