// SPDX-License-Identifier: MIT
#include "bake_minimal/atlas.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>

#include "bake_minimal/atlas_check.hpp"
#include "bake_minimal/atlas_edit.hpp"
#include "bake_minimal/unwrap.hpp"
#include "container/base/limits.hpp"
#include "decoders/texel_raster.hpp"

namespace relit::bake {
namespace {

constexpr int kCheckSide = 1024;
constexpr int kGreatestGutter = 64;
constexpr int kReportedGutter = 8;

using Posed = std::vector<std::vector<glm::vec3>>;

std::string label(const Scene& scene, std::size_t primitive) {
  const std::string& name = scene.primitives[primitive].name;
  return "primitive " + std::to_string(primitive) + (name.empty() ? "" : " (" + name + ")");
}

std::string percent(double share) {
  const auto thousandths = std::llround(share * 1e5);
  return std::to_string(thousandths / 1000) + "." +
         std::to_string(thousandths % 1000 + 1000).substr(1) + " %";
}

// Chosen primitives as one triangle list.
struct Soup {
  std::vector<glm::vec3> positions;  // posed
  std::vector<glm::vec3> normals;
  std::vector<glm::vec2> uv;
  std::vector<std::uint32_t> group;
  std::vector<std::uint32_t> indices;
};

class UvAssigner {
 public:
  UvAssigner(Scene& scene, std::span<const std::vector<glm::vec3>> posed,
             const AtlasOptions& options)
      : scene_(scene), options_(options), added_(scene.primitives.size(), false) {
    posed_.assign(posed.begin(), posed.end());
  }

  Result<AtlasReport> run() {
    RELIT_TRY(validate());
    if (options_.source != AtlasOptions::Source::kUnwrap) {
      int sets = 0;
      for (std::size_t i = 0; i < scene_.primitives.size(); ++i) {
        if (!added_[i])
          sets = std::max(sets, static_cast<int>(scene_.primitives[i].texcoords.size()));
      }
      const bool forced = options_.source == AtlasOptions::Source::kSet;
      const int first = forced ? options_.set : 0;
      const int end = forced ? options_.set + 1 : sets;
      for (int set = first; set < end; ++set) {
        const std::optional<std::string> refusal = refuse(set);
        if (!refusal) return take_set(set);
        if (!report_.reason.empty()) report_.reason += "; ";
        report_.reason += "UV set " + std::to_string(set) + ": " + *refusal;
      }
      if (forced) {
        return fail(ErrorCode::kInvalid, "light map: " + report_.reason +
                                             "; choose another set, or let it be unwrapped");
      }
      if (sets == 0) report_.reason = "the file has no UV set";
    }
    return unwrap();
  }

 private:
  Status validate() {
    const auto bad = [](const std::string& what) {
      return fail(ErrorCode::kInvalid, "light map: " + what);
    };
    const auto side = static_cast<int>(limits::kLightMapSide);
    if (options_.width < 1 || options_.height < 1 || options_.width > side ||
        options_.height > side) {
      return bad("size " + std::to_string(options_.width) + "x" + std::to_string(options_.height) +
                 " is not within 1.." + std::to_string(side));
    }
    if (options_.gutter < 0 || options_.gutter > kGreatestGutter) {
      return bad("gutter " + std::to_string(options_.gutter) + " is not within 0.." +
                 std::to_string(kGreatestGutter));
    }
    if (!(options_.added_density > 0) || !std::isfinite(options_.added_density)) {
      return bad("the density of added primitives must be above 0");
    }
    if (options_.source == AtlasOptions::Source::kSet && options_.set < 0) {
      return bad("there is no UV set " + std::to_string(options_.set));
    }
    if (posed_.size() != scene_.primitives.size()) {
      return bad(std::to_string(posed_.size()) + " posed primitives for " +
                 std::to_string(scene_.primitives.size()));
    }
    for (std::size_t i = 0; i < posed_.size(); ++i) {
      if (posed_[i].size() != scene_.primitives[i].positions.size()) {
        return bad(label(scene_, i) + " has " +
                   std::to_string(scene_.primitives[i].positions.size()) + " vertices, but " +
                   std::to_string(posed_[i].size()) + " posed ones");
      }
    }
    for (const std::uint32_t i : options_.added) {
      if (i >= added_.size()) return bad("there is no primitive " + std::to_string(i));
      added_[i] = true;
    }
    return {};
  }

  bool double_sided(std::size_t i) const {
    const Primitive& p = scene_.primitives[i];
    return scene_.materials[static_cast<std::size_t>(p.material)].double_sided;
  }

  // Why a set does not qualify; nothing if it does.
  std::optional<std::string> refuse(int set) const {
    const auto s = static_cast<std::size_t>(set);
    bool any = false;
    for (std::size_t i = 0; i < scene_.primitives.size(); ++i) {
      if (added_[i]) continue;
      const Primitive& p = scene_.primitives[i];
      any = true;
      if (s >= p.texcoords.size() || p.texcoords[s].size() != p.positions.size()) {
        return label(scene_, i) + " does not have it";
      }
      if (double_sided(i)) {
        return label(scene_, i) + " is double-sided, so that both of its sides would share texels";
      }
      for (const std::uint32_t v : p.indices) {
        const glm::vec2 uv = p.texcoords[s][v];
        const float out = std::max(std::max(-uv.x, uv.x - 1), std::max(-uv.y, uv.y - 1));
        // Written so that NaN fails it.
        if (!(out <= kOutsideTolerance)) {
          return label(scene_, i) + " leaves [0,1], at (" + std::to_string(uv.x) + ", " +
                 std::to_string(uv.y) + ")";
        }
      }
    }
    if (!any) return "no primitive has it";
    const Soup soup = gather(set);
    const OverlapCount overlap = count_overlap(soup.uv, soup.indices, kCheckSide, kCheckSide);
    if (overlap.share() > kOverlapTolerance) {
      return percent(overlap.share()) + " of the covered texels belong to two triangles";
    }
    const double roomless = roomless_share(soup);
    if (overlap.covered == 0 || roomless > kRoomlessTolerance) {
      return percent(roomless) + " of the surface has no room in it";
    }
    return std::nullopt;
  }

  // The primitives that are the file's, with UVs of a set.
  Soup gather(int set) const {
    Soup soup;
    for (std::size_t i = 0; i < scene_.primitives.size(); ++i) {
      if (added_[i]) continue;
      const Primitive& p = scene_.primitives[i];
      const auto base = static_cast<std::uint32_t>(soup.uv.size());
      for (const glm::vec2& uv : p.texcoords[static_cast<std::size_t>(set)]) {
        soup.uv.push_back(glm::clamp(uv, 0.0f, 1.0f));
      }
      soup.positions.insert(soup.positions.end(), posed_[i].begin(), posed_[i].end());
      for (const std::uint32_t v : p.indices) soup.indices.push_back(base + v);
    }
    return soup;
  }

  static double posed_area(const Soup& s, std::size_t t) {
    const glm::dvec3 a(s.positions[s.indices[3 * t]]);
    const glm::dvec3 b(s.positions[s.indices[3 * t + 1]]);
    const glm::dvec3 c(s.positions[s.indices[3 * t + 2]]);
    const double area = glm::length(glm::cross(b - a, c - a)) / 2;
    return std::isfinite(area) ? area : 0.0;
  }

  // In the unit square, as if it were one whatever the atlas's shape.
  static double uv_area(const Soup& s, std::size_t t) {
    const glm::dvec2 a(s.uv[s.indices[3 * t]]);
    const glm::dvec2 b = glm::dvec2(s.uv[s.indices[3 * t + 1]]) - a;
    const glm::dvec2 c = glm::dvec2(s.uv[s.indices[3 * t + 2]]) - a;
    return std::abs(b.x * c.y - b.y * c.x) / 2;
  }

  static double roomless_share(const Soup& soup) {
    double all = 0, without = 0;
    for (std::size_t t = 0; 3 * t + 2 < soup.indices.size(); ++t) {
      const double area = posed_area(soup, t);
      all += area;
      const decoders::FixedTriangle fixed(soup.uv[soup.indices[3 * t]],
                                          soup.uv[soup.indices[3 * t + 1]],
                                          soup.uv[soup.indices[3 * t + 2]], kCheckSide, kCheckSide);
      if (fixed.degenerate()) without += area;
    }
    return all > 0 ? without / all : 0.0;
  }

  Result<AtlasReport> take_set(int set) {
    report_.set = set;
    if (std::find(added_.begin(), added_.end(), true) != added_.end()) return repack(set);
    note_corners(scene_.primitives);
    for (Primitive& p : scene_.primitives) {
      p.lightmap_uv = p.texcoords[static_cast<std::size_t>(set)];
      for (glm::vec2& uv : p.lightmap_uv) {
        // Only vertices that no triangle uses were not checked.
        const bool sane = std::isfinite(uv.x) && std::isfinite(uv.y);
        uv = sane ? glm::clamp(uv, 0.0f, 1.0f) : glm::vec2(0.0f);
      }
    }
    finish_report();
    return report_;
  }

  ChartPackOptions pack_options() const {
    return {options_.width, options_.height, options_.gutter};
  }

  // UV units over metres, the median over the triangles.
  static double median_density(const Soup& soup) {
    std::vector<double> density;
    for (std::size_t t = 0; 3 * t + 2 < soup.indices.size(); ++t) {
      const double area = posed_area(soup, t);
      const double uv = uv_area(soup, t);
      if (area > 0 && uv > 0) density.push_back(std::sqrt(uv / area));
    }
    if (density.empty()) return 1.0;
    const auto middle = density.begin() + static_cast<std::ptrdiff_t>(density.size() / 2);
    std::nth_element(density.begin(), middle, density.end());
    return *middle;
  }

  Result<AtlasReport> repack(int set) {
    Soup soup = gather(set);
    const double density = median_density(soup);
    const UvCharts charts = find_uv_charts(soup.uv, soup.indices);
    std::vector<PackShape> shapes(static_cast<std::size_t>(charts.count));
    std::vector<std::uint32_t> local(soup.uv.size(), 0);
    std::vector<std::uint32_t> chart_of(soup.uv.size(), kNoTriangle);
    for (std::size_t t = 0; t < charts.of_triangle.size(); ++t) {
      PackShape& shape = shapes[charts.of_triangle[t]];
      std::array<std::uint32_t, 3> tri;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t v = soup.indices[3 * t + k];
        if (chart_of[v] == kNoTriangle) {
          chart_of[v] = charts.of_triangle[t];
          local[v] = static_cast<std::uint32_t>(shape.points.size());
          shape.points.emplace_back(soup.uv[v]);
        }
        tri[k] = local[v];
      }
      shape.triangles.push_back(tri);
    }
    const Soup extra = added_soup(options_.added_density * density);
    const Surface surface({extra.positions, extra.normals, extra.group, extra.indices});
    const std::vector<FlatChart> flat = make_charts(surface, pack_options());
    for (const FlatChart& f : flat) shapes.push_back(to_shape(f));
    RELIT_ASSIGN(const PackResult packed, pack_shapes(shapes, pack_options()));

    const std::span<const std::vector<glm::dvec2>> texels(packed.points);
    const std::vector<glm::vec2> extra_uv = corner_uvs(
        surface, flat, texels.subspan(static_cast<std::size_t>(charts.count)), pack_options());
    const glm::dvec2 size(options_.width, options_.height);
    note_corners(scene_.primitives);
    std::size_t vertex = 0, corner = 0;
    for (std::size_t i = 0; i < scene_.primitives.size(); ++i) {
      Primitive& p = scene_.primitives[i];
      if (added_[i]) {
        set_corner_uvs(p, std::span(extra_uv).subspan(corner, p.indices.size()));
        corner += p.indices.size();
        continue;
      }
      p.lightmap_uv.assign(p.positions.size(), glm::vec2(0.0f));
      for (glm::vec2& uv : p.lightmap_uv) {
        if (chart_of[vertex] != kNoTriangle) {
          uv = snap_uv(texels[chart_of[vertex]][local[vertex]] / size);
        }
        ++vertex;
      }
    }
    report_.repacked = true;
    finish_report();
    return report_;
  }

  Soup added_soup(double density) const {
    Soup soup;
    for (std::size_t i = 0; i < scene_.primitives.size(); ++i) {
      if (added_[i]) append(soup, scene_.primitives[i], posed_[i], density, 1);
    }
    return soup;
  }

  // Scaling positions by the wanted density makes the unwrap's even density the wanted one. Both
  // sides of a surface lie in the same place and so must not be welded.
  static void append(Soup& soup, const Primitive& p, const std::vector<glm::vec3>& posed,
                     double density, std::uint32_t kind) {
    const auto base = static_cast<std::uint32_t>(soup.positions.size());
    std::vector<bool> back(posed.size(), false);
    for (std::size_t t = 0; t < p.other_side.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) back[p.indices[3 * t + k]] = p.other_side[t] < t;
    }
    for (std::size_t v = 0; v < posed.size(); ++v) {
      soup.positions.push_back(glm::vec3(glm::dvec3(posed[v]) * density));
      soup.normals.push_back(v < p.normals.size() ? p.normals[v] : glm::vec3(0, 0, 1));
      soup.group.push_back(2 * kind + (back[v] ? 1u : 0u));
    }
    for (const std::uint32_t v : p.indices) soup.indices.push_back(base + v);
  }

  Result<AtlasReport> unwrap() {
    // On copies, since it may still fail.
    std::vector<Primitive> primitives = scene_.primitives;
    Soup soup;
    for (std::size_t i = 0; i < primitives.size(); ++i) {
      Primitive& p = primitives[i];
      p.indices.resize(p.indices.size() / 3 * 3);
      if (double_sided(i) && p.other_side.empty()) add_other_side(p, posed_[i]);
      append(soup, p, posed_[i], added_[i] ? options_.added_density : 1.0, added_[i] ? 1 : 0);
    }
    RELIT_ASSIGN(
        const Unwrapped unwrapped,
        unwrap_surface({soup.positions, soup.normals, soup.group, soup.indices}, pack_options()));
    note_corners(primitives);
    std::size_t corner = 0;
    for (Primitive& p : primitives) {
      const std::size_t count = p.indices.size();
      set_corner_uvs(p, std::span(unwrapped.corner_uv).subspan(corner, count));
      corner += count;
    }
    scene_.primitives = std::move(primitives);
    finish_report();
    return report_;
  }

  // Posed corners, three a triangle, in metres times wanted density: vertices are about to be
  // split.
  void note_corners(std::span<const Primitive> primitives) {
    corners_.clear();
    for (std::size_t i = 0; i < primitives.size(); ++i) {
      const double density = added_[i] ? options_.added_density : 1.0;
      for (const std::uint32_t v : primitives[i].indices) {
        corners_.push_back(glm::dvec3(posed_[i][v]) * density);
      }
    }
  }

  void finish_report() {
    Soup soup;
    for (const Primitive& p : scene_.primitives) {
      const auto base = static_cast<std::uint32_t>(soup.uv.size());
      soup.uv.insert(soup.uv.end(), p.lightmap_uv.begin(), p.lightmap_uv.end());
      for (const std::uint32_t v : p.indices) soup.indices.push_back(base + v);
    }
    const UvCharts charts = find_uv_charts(soup.uv, soup.indices);
    report_.charts = charts.count;
    report_.gutter = measure_gutter(soup.uv, soup.indices, charts,
                                    {options_.width, options_.height}, kReportedGutter);
    const OverlapCount count =
        count_overlap(soup.uv, soup.indices, options_.width, options_.height);
    report_.coverage = static_cast<double>(count.covered) /
                       (static_cast<double>(options_.width) * options_.height);
    std::vector<double> density;
    for (std::size_t t = 0; 3 * t + 2 < corners_.size(); ++t) {
      const glm::dvec3 a = corners_[3 * t];
      const double area =
          glm::length(glm::cross(corners_[3 * t + 1] - a, corners_[3 * t + 2] - a)) / 2;
      const double uv = uv_area(soup, t);
      if (area > 0 && std::isfinite(area) && uv > 0) density.push_back(std::sqrt(uv / area));
    }
    if (density.empty()) return;
    std::sort(density.begin(), density.end());
    const auto quantile = [&](double q) {
      return density[static_cast<std::size_t>(q * static_cast<double>(density.size() - 1) + 0.5)];
    };
    report_.density_p5 = quantile(0.05) / quantile(0.5);
    report_.density_p95 = quantile(0.95) / quantile(0.5);
  }

  Scene& scene_;
  const AtlasOptions& options_;
  std::vector<bool> added_;
  Posed posed_;
  std::vector<glm::dvec3> corners_;
  AtlasReport report_;
};

}  // namespace

Result<AtlasReport> assign_lightmap_uvs(Scene& scene, std::span<const std::vector<glm::vec3>> posed,
                                        const AtlasOptions& options) {
  return UvAssigner(scene, posed, options).run();
}

}  // namespace relit::bake
