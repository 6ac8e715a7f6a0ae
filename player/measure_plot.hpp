// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Plots as SVG elements for `relit measure`'s page. Colours are the page's (classes), so that they
/// follow its scheme; the same input gives the same text.
namespace relit::player {

/// Safe between tags and inside quoted attributes. What is no UTF-8 becomes U+FFFD, control
/// characters become blanks.
[[nodiscard]] std::string html_escape(std::string_view text);

struct PlotPoint {
  double x = 0;        ///< > 0
  double y = 0;        ///< dB; infinite: at the top
  std::string label;   ///< at the point, as far as there is room
  std::string number;  ///< in its place where there is too little room, such as "12"
  std::string hint;    ///< when the pointer rests on it
  int series = 0;      ///< colour and shape; 0 to kPlotSeries - 1
  bool front = false;
};
constexpr int kPlotSeries = 6;

struct PlotOptions {
  int width = 1040, height = 460;
  std::string x_title, y_title;
  /// What lies above is drawn at the top edge, with an arrow: no eye sees it.
  double y_most = 60;
};

/// Error against cost: the cost's axis is logarithmic, the front is a line. Points that would lie
/// on one that came before are left out.
[[nodiscard]] std::string scatter_plot(std::span<const PlotPoint> points,
                                       const PlotOptions& options);

/// A point's mark alone, for legends.
[[nodiscard]] std::string plot_mark(int series);

struct PlotBar {
  std::string label;
  double first = 0, second = 0;  ///< stacked
};
/// Horizontal bars; the labels are above them where the plot is narrow.
[[nodiscard]] std::string bar_plot(std::span<const PlotBar> bars, int width,
                                   const std::string& unit);

/// 1, 2 and 5 times powers of ten within [low, high], for logarithmic axes; round steps where there
/// are fewer than three of them.
[[nodiscard]] std::vector<double> log_ticks(double low, double high);
/// Round steps within [low, high], about `count` of them.
[[nodiscard]] std::vector<double> linear_ticks(double low, double high, int count);

}  // namespace relit::player
