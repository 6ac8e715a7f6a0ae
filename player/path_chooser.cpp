// SPDX-License-Identifier: MIT
#include "player/path_chooser.hpp"

#include <cmath>
#include <cstdio>

namespace relit::player {
namespace {

constexpr std::array<const char*, kCompositePaths> kNames{"auto", "cpu", "texture", "fused"};

std::size_t index(CompositePath path) { return static_cast<std::size_t>(path); }

bool is_cost(double cost_s) { return std::isfinite(cost_s) && cost_s > 0; }

}  // namespace

Result<CompositePath> parse_composite_path(const std::string& name) {
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (name == kNames[i]) return static_cast<CompositePath>(i);
  }
  return fail(ErrorCode::kInvalid,
              "--composite " + name + ": it must be auto, cpu, texture or fused");
}

const char* composite_path_name(CompositePath path) { return kNames[index(path)]; }

PathChooser::PathChooser(std::array<bool, kCompositePaths> available) : available_(available) {
  available_[index(CompositePath::kAuto)] = false;
  available_[index(CompositePath::kCpu)] = true;
  path_ =
      available_[index(CompositePath::kTexture)] ? CompositePath::kTexture : CompositePath::kCpu;
}

bool PathChooser::wants_measuring(double covered_pixels) {
  int choices = 0;
  for (const bool is : available_) choices += is ? 1 : 0;
  if (choices < 2 || !is_cost(covered_pixels)) return false;
  covered_pixels_ = covered_pixels;
  if (!measured_) return true;
  const bool other = covered_pixels >= kOtherCoverage * measured_pixels_ ||
                     covered_pixels * kOtherCoverage <= measured_pixels_;
  settled_ = other ? settled_ + 1 : 0;
  return settled_ >= kSettleViews;
}

void PathChooser::take(const std::array<double, kCompositePaths>& cost_s) {
  for (std::size_t i = 0; i < cost_s.size(); ++i)
    cost_s_[i] = available_[i] && is_cost(cost_s[i]) ? cost_s[i] : 0;
  CompositePath cheapest = path_;
  for (std::size_t i = 0; i < cost_s.size(); ++i) {
    if (cost_s_[i] <= 0) continue;
    const double best = cost_s_[index(cheapest)];
    if (best <= 0 || cost_s_[i] < best) cheapest = static_cast<CompositePath>(i);
  }
  const double present = cost_s_[index(path_)];
  const bool clearly = present <= 0 || cost_s_[index(cheapest)] < kClearlyCheaper * present;
  kept_ = measured_ && cheapest != path_ && !clearly;
  if (!kept_) path_ = cheapest;
  measured_ = true;
  measured_pixels_ = covered_pixels_;
  settled_ = 0;
}

std::string PathChooser::why() const {
  std::string text = kNames[index(path_)];
  if (!measured_) return text + ": not measured yet";
  text += ": measured";
  for (std::size_t i = 0; i < cost_s_.size(); ++i) {
    if (cost_s_[i] <= 0) continue;
    char cost[48];
    std::snprintf(cost, sizeof cost, " %s %.2f ms", kNames[i], 1e3 * cost_s_[i]);
    text += (text.back() == 'd' ? "" : ",") + std::string(cost);
  }
  char pixels[64];
  std::snprintf(pixels, sizeof pixels, " a frame, at %.0f covered pixels", measured_pixels_);
  return text + pixels + (kept_ ? "; no other is clearly cheaper" : "");
}

}  // namespace relit::player
