// SPDX-License-Identifier: MIT
#include "player/measure_plot.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "player/measure_text.hpp"

namespace relit::player {

std::string html_escape(std::string_view text) {
  // The one place that knows how to mend UTF-8.
  const std::string mended =
      nlohmann::json::parse(nlohmann::json(std::string(text))
                                .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace))
          .get<std::string>();
  std::string out;
  for (const char c : mended) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += static_cast<unsigned char>(c) < 0x20 || c == 0x7F ? ' ' : c;
    }
  }
  return out;
}

std::vector<double> log_ticks(double low, double high) {
  std::vector<double> ticks;
  for (int decade = static_cast<int>(std::floor(std::log10(low)));
       std::pow(10.0, decade) <= high * (1 + 1e-9); ++decade) {
    for (const double digit : {1.0, 2.0, 5.0}) {
      const double value = digit * std::pow(10.0, decade);
      if (value >= low * (1 - 1e-9) && value <= high * (1 + 1e-9)) ticks.push_back(value);
    }
  }
  return ticks.size() < 3 ? linear_ticks(low, high, 5) : ticks;
}

std::vector<double> linear_ticks(double low, double high, int count) {
  const double rough = (high - low) / count;
  if (!(rough > 0)) return {low};
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10 * power;
  for (const double digit : {5.0, 2.0, 1.0})
    if (digit * power >= rough * (1 - 1e-9)) step = digit * power;
  std::vector<double> ticks;
  for (auto i = static_cast<long>(std::ceil(low / step - 1e-9));
       static_cast<double>(i) * step <= high + 1e-9 * step; ++i)
    ticks.push_back(static_cast<double>(i) * step);
  return ticks;
}

namespace {

std::string px(double value) {
  std::string text = fixed(value, 1);
  return text == "-0.0" ? "0.0" : text;
}

std::string text_at(double x, double y, const char* anchor, const std::string& text,
                    const char* kind = "t") {
  return "<text class=\"" + std::string(kind) + "\" x=\"" + px(x) + "\" y=\"" + px(y) +
         "\" text-anchor=\"" + anchor + "\">" + html_escape(text) + "</text>\n";
}

std::string line_at(const char* kind, double x1, double y1, double x2, double y2) {
  return "<line class=\"" + std::string(kind) + "\" x1=\"" + px(x1) + "\" y1=\"" + px(y1) +
         "\" x2=\"" + px(x2) + "\" y2=\"" + px(y2) + "\"/>\n";
}

// Shapes tell series apart where colours do not.
std::string mark_path(int series, double x, double y, double r) {
  const auto at = [&](double dx, double dy) { return px(x + r * dx) + " " + px(y + r * dy); };
  switch (series) {
    case 0:
      return "M" + at(-1, 0) + "a" + px(r) + " " + px(r) + " 0 1 0 " + px(2 * r) + " 0a" + px(r) +
             " " + px(r) + " 0 1 0 " + px(-2 * r) + " 0z";
    case 1:
      return "M" + at(-0.9, -0.9) + "L" + at(0.9, -0.9) + "L" + at(0.9, 0.9) + "L" + at(-0.9, 0.9) +
             "z";
    case 2:
      return "M" + at(0, -1.25) + "L" + at(1.25, 0) + "L" + at(0, 1.25) + "L" + at(-1.25, 0) + "z";
    case 3:
      return "M" + at(0, -1.15) + "L" + at(1.1, 0.85) + "L" + at(-1.1, 0.85) + "z";
    case 4:
      return "M" + at(0, 1.15) + "L" + at(1.1, -0.85) + "L" + at(-1.1, -0.85) + "z";
    default:
      return "M" + at(-1.2, -0.55) + "L" + at(0, -1.2) + "L" + at(1.2, -0.55) + "L" + at(0.75, 1) +
             "L" + at(-0.75, 1) + "z";
  }
}

struct Box {
  double x0, y0, x1, y1;
  [[nodiscard]] bool meets(const Box& o) const {
    return x0 < o.x1 && o.x0 < x1 && y0 < o.y1 && o.y0 < y1;
  }
  [[nodiscard]] bool within(const Box& o) const {
    return x0 >= o.x0 && x1 <= o.x1 && y0 >= o.y0 && y1 <= o.y1;
  }
};

// Of the page's fonts the widest has letters of about that width, on average.
constexpr double kFont = 12, kLetter = 0.6 * kFont, kMark = 4.5;

double text_width(const std::string& text) {
  const auto letters =
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; });
  return kLetter * static_cast<double>(letters);
}

// Where points, axes and labels lie, in pixels.
class Scatter {
 public:
  Scatter(std::span<const PlotPoint> points, const PlotOptions& options);
  [[nodiscard]] std::string draw();

 private:
  struct Placed {
    const PlotPoint* point;
    double x, y;
    bool beyond;
  };
  void choose_range(std::span<const PlotPoint> points);
  void place(std::span<const PlotPoint> points);
  [[nodiscard]] double x_of(double value) const {
    const double t = std::log(value / low_x_) / std::log(high_x_ / low_x_);
    return area_.x0 + t * (area_.x1 - area_.x0);
  }
  [[nodiscard]] double y_of(double value) const {
    return area_.y1 - (value - low_y_) / (high_y_ - low_y_) * (area_.y1 - area_.y0);
  }
  [[nodiscard]] std::string axes() const;
  [[nodiscard]] std::string front() const;
  [[nodiscard]] std::string marks() const;
  [[nodiscard]] std::string labels();
  bool try_label(const Placed& placed, const std::string& text, std::string& out);

  const PlotOptions& options_;
  Box area_{};
  double low_x_ = 1, high_x_ = 10, low_y_ = 0, high_y_ = 1;
  bool beyond_ = false;  // some points lie above the top
  std::vector<Placed> placed_;
  std::vector<Box> taken_;
};

Scatter::Scatter(std::span<const PlotPoint> points, const PlotOptions& options)
    : options_(options) {
  area_ = {44, 26, options.width - 14.0, options.height - 46.0};
  choose_range(points);
  place(points);
}

void Scatter::choose_range(std::span<const PlotPoint> points) {
  double x0 = HUGE_VAL, x1 = 0, y0 = HUGE_VAL, y1 = -HUGE_VAL;
  for (const PlotPoint& point : points) {
    x0 = std::min(x0, point.x), x1 = std::max(x1, point.x);
    const double y = std::min(point.y, options_.y_most);
    beyond_ = beyond_ || point.y > options_.y_most;
    y0 = std::min(y0, y), y1 = std::max(y1, y);
  }
  // Some room around, and at least a factor of four and six decibels across.
  const double middle = std::sqrt(x0 * x1), spread = std::max(1.25 * std::sqrt(x1 / x0), 2.0);
  low_x_ = middle / spread, high_x_ = middle * spread;
  const double room = std::max(0.08 * (y1 - y0), 3 - (y1 - y0) / 2);
  low_y_ = y0 - room;
  high_y_ = beyond_ ? options_.y_most : y1 + room;
}

// In order, front first, so that of points that coincide the first on the front is drawn.
void Scatter::place(std::span<const PlotPoint> points) {
  for (const bool front : {true, false}) {
    for (const PlotPoint& point : points) {
      if (point.front != front) continue;
      const bool beyond = point.y > options_.y_most;
      const Placed placed{&point, x_of(point.x), beyond ? area_.y0 : y_of(point.y), beyond};
      const bool hidden = std::any_of(placed_.begin(), placed_.end(), [&](const Placed& p) {
        return std::hypot(p.x - placed.x, p.y - placed.y) < 2;
      });
      if (hidden) continue;
      placed_.push_back(placed);
      taken_.push_back(
          {placed.x - kMark - 1, placed.y - kMark - 1, placed.x + kMark + 1, placed.y + kMark + 1});
    }
  }
}

std::string tick_text(double value) {
  int digits = 0;
  for (double v = value; digits < 4 && std::abs(v - std::round(v)) > 1e-6; v *= 10) ++digits;
  return fixed(value, digits);
}

std::string Scatter::axes() const {
  std::string out;
  for (const double value : linear_ticks(low_y_, high_y_, options_.height / 60)) {
    out += line_at("grid", area_.x0, y_of(value), area_.x1, y_of(value));
    const bool top = beyond_ && value == options_.y_most;
    out += text_at(area_.x0 - 8, y_of(value) + 4, "end", (top ? "≥" : "") + tick_text(value));
  }
  double last = -HUGE_VAL;
  for (const double value : log_ticks(low_x_, high_x_)) {
    const double x = x_of(value);
    out += line_at("grid", x, area_.y0, x, area_.y1);
    const std::string text = tick_text(value);
    if (x - text_width(text) / 2 < last) continue;
    out += text_at(x, area_.y1 + 18, "middle", text);
    last = x + text_width(text) / 2 + 8;
  }
  out += line_at("axis", area_.x0, area_.y1, area_.x1, area_.y1);
  out += line_at("axis", area_.x0, area_.y0, area_.x0, area_.y1);
  out += text_at(area_.x0 - 36, 13, "start", options_.y_title, "t title");
  out += text_at(area_.x1, area_.y1 + 38, "end", options_.x_title, "t title");
  return out;
}

std::string Scatter::front() const {
  std::vector<const Placed*> front;
  for (const Placed& placed : placed_)
    if (placed.point->front) front.push_back(&placed);
  if (front.size() < 2) return "";
  std::sort(front.begin(), front.end(), [](auto* a, auto* b) { return a->x < b->x; });
  std::string points;
  for (const Placed* placed : front)
    points += (points.empty() ? "" : " ") + px(placed->x) + "," + px(placed->y);
  return "<polyline class=\"front\" points=\"" + points + "\"/>\n";
}

std::string Scatter::marks() const {
  std::string out;
  for (const Placed& placed : placed_) {
    const PlotPoint& point = *placed.point;
    out += "<path class=\"mark s" + std::to_string(point.series) + (point.front ? " on" : "") +
           "\" d=\"" + mark_path(point.series, placed.x, placed.y, kMark) + "\"><title>" +
           html_escape(point.hint) + "</title></path>\n";
  }
  return out;
}

bool Scatter::try_label(const Placed& placed, const std::string& text, std::string& out) {
  const double width = text_width(text), gap = kMark + 4;
  struct Place {
    double dx, dy;  // from the point to the text's middle, in halves of its size and gaps
    bool leader;
  };
  constexpr Place kPlaces[] = {{1, 0, false},   {-1, 0, false}, {0, -1, false},  {0, 1, false},
                               {1, -1, false},  {1, 1, false},  {-1, -1, false}, {-1, 1, false},
                               {1, -2.4, true}, {1, 2.4, true}, {-1, 2.4, true}, {-1, -2.4, true},
                               {1, -4.2, true}, {1, 4.2, true}, {-1, 4.2, true}, {-1, -4.2, true},
                               {1, 6, true},    {-1, 6, true},  {1, -6, true},   {-1, -6, true}};
  const Box room{area_.x0 + 2, area_.y0 - 12, area_.x1 + 12, area_.y1 - 2};
  for (const Place& place : kPlaces) {
    const double x = placed.x + place.dx * (gap + width / 2);
    const double y = placed.y + place.dy * (place.dx == 0 ? gap + kFont / 2 : kFont * 0.75);
    const Box box{x - width / 2 - 1, y - kFont / 2 - 1, x + width / 2 + 1, y + kFont / 2 + 1};
    if (!box.within(room)) continue;
    const auto own = static_cast<std::size_t>(&placed - placed_.data());
    bool free = true;
    for (std::size_t i = 0; i < taken_.size() && free; ++i)
      free = i == own || !box.meets(taken_[i]);
    if (!free) continue;
    taken_.push_back(box);
    if (place.leader)
      out += line_at("leader", placed.x, placed.y, x - place.dx * (width / 2 + 2), y);
    out += text_at(x, y + 4, "middle", text, placed.point->front ? "t label on" : "t label");
    return true;
  }
  return false;
}

std::string Scatter::labels() {
  std::string out;
  for (const Placed& placed : placed_)
    if (!try_label(placed, placed.point->label, out)) try_label(placed, placed.point->number, out);
  return out;
}

std::string svg(int width, int height, const std::string& title, const std::string& body) {
  return "<svg viewBox=\"0 0 " + std::to_string(width) + " " + std::to_string(height) +
         "\" width=\"" + std::to_string(width) + "\" height=\"" + std::to_string(height) +
         "\" role=\"img\" aria-label=\"" + html_escape(title) + "\">\n" + body + "</svg>\n";
}

std::string Scatter::draw() {
  return svg(options_.width, options_.height, options_.y_title + " against " + options_.x_title,
             axes() + front() + labels() + marks());
}

}  // namespace

std::string scatter_plot(std::span<const PlotPoint> points, const PlotOptions& options) {
  if (points.empty()) return "";
  return Scatter(points, options).draw();
}

std::string plot_mark(int series) {
  return "<svg class=\"key\" viewBox=\"0 0 12 12\" width=\"12\" height=\"12\" "
         "aria-hidden=\"true\"><path class=\"mark s" +
         std::to_string(series) + "\" d=\"" + mark_path(series, 6, 6, kMark) + "\"/></svg>";
}

namespace {

// As much of a text as `width` pixels hold.
std::string fitted(const std::string& text, double width) {
  if (text_width(text) <= width) return text;
  std::string out = text;
  while (!out.empty() && text_width(out) + kLetter > width) {
    while (out.size() > 1 && (out.back() & 0xC0) == 0x80) out.pop_back();
    out.pop_back();
  }
  return out + "…";
}

}  // namespace

std::string bar_plot(std::span<const PlotBar> bars, int width, const std::string& unit) {
  if (bars.empty()) return "";
  const bool narrow = width < 560;
  double most = 0, label_width = 0;
  for (const PlotBar& bar : bars) {
    most = std::max(most, bar.first + bar.second);
    label_width = std::max(label_width, text_width(bar.label));
  }
  if (!(most > 0)) return "";
  const double left = narrow ? 0 : std::min(label_width + 12, 0.42 * width);
  const double row = narrow ? 38 : 24, right = width - 56.0;
  const double scale = (right - left) / most;
  std::string body;
  double y = 4;
  for (const PlotBar& bar : bars) {
    const double top = narrow ? y + 17 : y + 3, high = 14;
    body += narrow ? text_at(0, y + 12, "start", fitted(bar.label, width))
                   : text_at(left - 10, y + 14, "end", fitted(bar.label, left - 10));
    const auto rect = [&](const char* kind, double from, double value) {
      if (value > 0)
        body += "<rect class=\"" + std::string(kind) + "\" x=\"" + px(left + from * scale) +
                "\" y=\"" + px(top) + "\" width=\"" + px(value * scale) + "\" height=\"" +
                px(high) + "\"/>\n";
    };
    rect("bar s0", 0, bar.first);
    rect("bar s1", bar.first, bar.second);
    body += text_at(left + (bar.first + bar.second) * scale + 6, top + 11, "start",
                    fixed(bar.first + bar.second, 1));
    y += row;
  }
  body += line_at("axis", left, 2, left, y);
  return svg(width, static_cast<int>(y) + 4, unit, body);
}

}  // namespace relit::player
