// SPDX-License-Identifier: MIT
// What `relit measure` writes: schemas, well-formedness, escaping.
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "player/measure_html.hpp"
#include "player/measure_machine.hpp"
#include "player/measure_pictures.hpp"
#include "player/measure_plot.hpp"
#include "player/measure_text.hpp"
#include "tests/player/measure_report.hpp"
#include "tests/test.hpp"

using namespace relit::player;
using namespace relit::player::test;

namespace {

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1))
    ++count;
  return count;
}

// What an XML parser would refuse of tags, attributes and entities; empty: nothing.
std::string malformed(const std::string& text) {
  std::vector<std::string> open;
  const std::string doctype = "<!DOCTYPE html>";
  std::size_t at = text.rfind(doctype, 0) == 0 ? doctype.size() : 0;
  while (at < text.size()) {
    const char c = text[at];
    if (c == '&') {
      const std::size_t end = text.find(';', at);
      const std::string name = text.substr(at, end - at + 1);
      if (name != "&amp;" && name != "&lt;" && name != "&gt;" && name != "&quot;" &&
          name != "&#39;")
        return "entity " + name;
      at = end + 1;
      continue;
    }
    if (c != '<') {
      ++at;
      continue;
    }
    std::size_t end = at + 1;
    bool quoted = false;
    for (; end < text.size() && (quoted || text[end] != '>'); ++end) {
      if (text[end] == '<') return "< in a tag: " + text.substr(at, 60);
      if (text[end] == '"') quoted = !quoted;
    }
    const std::string tag = text.substr(at + 1, end - at - 1);
    const std::string name = tag.substr(0, tag.find_first_of(" /", 1));
    if (tag[0] == '/') {
      if (open.empty() || open.back() != tag.substr(1)) return "end of " + tag;
      open.pop_back();
    } else if (tag.back() != '/') {
      open.push_back(name);
    }
    at = end + 1;
  }
  return open.empty() ? "" : "no end of " + open.back();
}

}  // namespace

TEST_CASE("CSV has a header, a line a point, and quotes what needs it") {
  const std::string csv = measure_csv(sample_report());
  CHECK(count_of(csv, "\r\n") == 5);
  CHECK(csv.rfind("file,model,label,order,", 0) == 0);
  CHECK(csv.find("\"in/a <b> & \"\"c\"\".relit\",shlm,") != std::string::npos);
  CHECK(csv.find("\"in/it's, too.relit\"") != std::string::npos);
  MeasureReport exact = sample_report();
  exact.points.resize(1);
  exact.points[0].error.psnr_db = std::numeric_limits<double>::infinity();
  CHECK(measure_csv(exact).find(",inf,") != std::string::npos);
}

TEST_CASE("JSON keeps its schema") {
  const auto json = measure_json(sample_report());
  CHECK(json["schema"] == "relit-measure");
  CHECK(json["schema_version"] == 1);
  CHECK(json["reference"]["baked"] == true);
  CHECK(json["reference"]["scored_frames"].get<std::vector<int>>() == std::vector<int>{0, 5});
  CHECK(json["lights"].size() == 2);
  REQUIRE(json["points"].size() == 4);
  const auto& point = json["points"][0];
  // MEASURE.md lists them; another program reads them by these names.
  const std::vector<std::string> keys{"file",
                                      "model",
                                      "label",
                                      "order",
                                      "width",
                                      "height",
                                      "codec",
                                      "bit_depth",
                                      "chroma",
                                      "lossless",
                                      "exponent_block",
                                      "exponent_hold",
                                      "prediction",
                                      "planes",
                                      "planes_of",
                                      "layers",
                                      "layers_of",
                                      "composite",
                                      "backend",
                                      "threads",
                                      "every",
                                      "light_bytes",
                                      "file_bytes",
                                      "light_bytes_per_s",
                                      "file_bytes_per_s",
                                      "psnr_db",
                                      "log_psnr_db",
                                      "p99",
                                      "max",
                                      "exact",
                                      "decode_ms",
                                      "upload_ms",
                                      "composite_ms",
                                      "draw_ms",
                                      "total_ms",
                                      "heap_bytes",
                                      "gpu_bytes",
                                      "lost_frames",
                                      "on_bytes_front",
                                      "on_time_front",
                                      "failure"};
  std::vector<std::string> found;
  for (const auto& [key, value] : point.items()) found.push_back(key);
  CHECK(found == keys);
  CHECK(point["psnr_db"] == 40);
  CHECK(point["draw_ms"].is_null());
  CHECK(point["backend"].is_null());
  CHECK(point["failure"].is_null());
  CHECK(json["points"][3]["psnr_db"].is_null());
  CHECK(json["points"][3]["failure"] == "not <possible>");
}

TEST_CASE("the table marks both fronts and says why a point has no score") {
  const std::string table = measure_table(sample_report());
  CHECK(count_of(table, "\n") == 6);
  CHECK(table.find("BT") != std::string::npos);
  CHECK(table.find("not <possible>") != std::string::npos);
  CHECK(table.find("40.00") != std::string::npos);
}

TEST_CASE("the page is well-formed, holds everything, and loads nothing") {
  MeasureReport report = sample_report();
  report.reference_png = {1, 2, 3, 4};
  report.pictures.push_back({0, {5, 6}, {7, 8, 9}});
  const std::string page = measure_html(report);
  CHECK(malformed(page).empty());
  INFO(malformed(page));
  CHECK(page.find("<b>") == std::string::npos);
  CHECK(page.find("soft <pipe>") == std::string::npos);
  CHECK(page.find("a &lt;b&gt; &amp; &quot;c&quot;") != std::string::npos);
  CHECK(page.find("not &lt;possible&gt;") != std::string::npos);
  CHECK(page.find("http") == std::string::npos);
  CHECK(page.find("<script") == std::string::npos);
  CHECK(page.find("url(") == std::string::npos);
  CHECK(count_of(page, "src=\"") == 3);
  CHECK(count_of(page, "src=\"data:image/png;base64,") == 3);
  CHECK(page.find("base64,AQIDBA==") != std::string::npos);
  CHECK(page.find("relit measure &#39;a &lt;b&gt; &amp; &quot;c&quot;.relit&#39;") !=
        std::string::npos);
  CHECK(measure_html(report) == page);
  // The check itself sees what is wrong.
  CHECK_FALSE(malformed("<p>a & b</p>").empty());
  CHECK_FALSE(malformed("<p><b></p></b>").empty());
  CHECK_FALSE(malformed("<p>").empty());
}

TEST_CASE("names are escaped whatever bytes they hold") {
  CHECK(html_escape("a<b>&\"'") == "a&lt;b&gt;&amp;&quot;&#39;");
  CHECK(html_escape("\xff\xfe") == "\xEF\xBF\xBD\xEF\xBF\xBD");
  CHECK(html_escape(std::string("a\0b\x1b", 4)) == "a b ");
  CHECK(html_escape("größer") == "größer");
  CHECK(shell_text({"relit", "it's", "", "a b"}) == "relit 'it'\\''s' '' 'a b'");
  const std::vector<std::uint8_t> bytes{'f', 'o', 'o', 'b', 'a'};
  CHECK(base64(bytes) == "Zm9vYmE=");
  CHECK(base64(std::span(bytes).first(3)) == "Zm9v");
  CHECK(base64({}).empty());
}

TEST_CASE("ticks are round") {
  CHECK(log_ticks(8, 300) == std::vector<double>{10, 20, 50, 100, 200});
  CHECK(log_ticks(1, 1).size() == 1);
  CHECK(linear_ticks(24, 47, 5) == std::vector<double>{25, 30, 35, 40, 45});
  CHECK(linear_ticks(-1, 1, 4) == std::vector<double>{-1, -0.5, 0, 0.5, 1});
}

TEST_CASE("labels of a plot lie neither on each other nor beyond its edges") {
  std::vector<PlotPoint> points;
  for (int i = 0; i < 40; ++i) {
    PlotPoint point;
    point.x = 100 + i % 7, point.y = 30 + 0.2 * (i % 11);
    point.label = "a label of point " + std::to_string(i), point.number = std::to_string(i);
    point.front = i < 5;
    points.push_back(point);
  }
  points.push_back({200, std::numeric_limits<double>::infinity(), "exact", "41", "", 1, true});
  PlotOptions options;
  options.width = 340, options.height = 360;
  const std::string svg = scatter_plot(points, options);
  CHECK(malformed(svg).empty());
  struct Text {
    double x, y, width;
  };
  std::vector<Text> texts;
  for (std::size_t at = svg.find("t label"); at != std::string::npos;
       at = svg.find("t label", at + 1)) {
    double x = 0, y = 0;
    const std::size_t begin = svg.find("x=\"", at);
    REQUIRE(std::sscanf(svg.c_str() + begin, "x=\"%lf\" y=\"%lf\"", &x, &y) == 2);
    const std::size_t open = svg.find('>', begin) + 1;
    const auto letters = static_cast<double>(svg.find('<', open) - open);
    texts.push_back({x, y, 6.7 * letters});
  }
  CHECK(texts.size() >= 6);
  for (std::size_t i = 0; i < texts.size(); ++i) {
    CHECK(texts[i].x - texts[i].width / 2 > 40);
    CHECK(texts[i].x + texts[i].width / 2 < 340);
    for (std::size_t j = 0; j < i; ++j) {
      const bool apart = std::abs(texts[i].x - texts[j].x) * 2 >= texts[i].width + texts[j].width ||
                         std::abs(texts[i].y - texts[j].y) >= 12;
      CHECK(apart);
    }
  }
  CHECK(scatter_plot({}, options).empty());
  CHECK(bar_plot({}, 300, "MiB").empty());
}

TEST_CASE("a difference is ink where pictures differ, and a silhouette where they do not") {
  const std::vector<std::uint8_t> a{100, 100, 100, 255, 0, 0, 0, 0, 10, 20, 30, 255};
  const std::vector<std::uint8_t> b{100, 100, 100, 255, 0, 0, 0, 0, 10, 20, 94, 255};
  std::vector<std::uint8_t> out(a.size());
  draw_difference(a, b, 8, out);
  CHECK(out[3] == 41);  // 0.16 of 255: the silhouette
  CHECK(out[0] == 128);
  CHECK(out[7] == 0);
  CHECK(out[11] == 255);  // 64 levels, eight times: as much ink as there is
  CHECK(out[8] == 214);
}
