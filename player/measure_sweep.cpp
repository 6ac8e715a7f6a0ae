// SPDX-License-Identifier: MIT
#include "player/measure_sweep.hpp"

#include <algorithm>
#include <charconv>

namespace relit::player {
namespace {

Result<std::vector<std::string>> words(const std::string& text, const char* option) {
  std::vector<std::string> out;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    out.push_back(text.substr(begin, end - begin));
    if (out.back().empty())
      return fail(ErrorCode::kInvalid,
                  std::string(option) + " \"" + text + "\": an empty value in the list");
    begin = end + 1;
  }
  return out;
}

bool parse_number(const std::string& text, std::uint64_t& out) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  return error == std::errc() && end == text.data() + text.size();
}

Result<std::vector<std::uint64_t>> numbers(const std::string& text, const char* option,
                                           std::uint64_t most) {
  RELIT_ASSIGN(const std::vector<std::string> list, words(text, option));
  std::vector<std::uint64_t> out;
  for (const std::string& word : list) {
    std::uint64_t& value = out.emplace_back();
    if (!parse_number(word, value) || value < 1 || value > most)
      return fail(ErrorCode::kInvalid, std::string(option) + " " + word +
                                           ": the values are numbers from 1 to " +
                                           std::to_string(most));
  }
  return out;
}

Result<std::vector<std::string>> plane_words(const std::string& text) {
  RELIT_ASSIGN(std::vector<std::string> list, words(text, "--planes"));
  for (const std::string& word : list) {
    std::uint64_t value = 0;
    if (word == "all" || word == "layers" || (parse_number(word, value) && value > 0)) continue;
    return fail(ErrorCode::kInvalid,
                "--planes " + word + ": the values are all, layers, and numbers from 1 on");
  }
  return list;
}

Result<std::vector<MeasureSweep::Path>> paths_of(const std::string& composite,
                                                 const std::vector<Backend>& backends) {
  RELIT_ASSIGN(const std::vector<std::string> list, words(composite, "--composite"));
  std::vector<MeasureSweep::Path> out;
  for (const std::string& word : list) {
    RELIT_ASSIGN(const CompositePath path, parse_composite_path(word));
    if (path == CompositePath::kAuto)
      return fail(ErrorCode::kInvalid, "--composite auto: name the paths: cpu, texture, fused");
    if (path == CompositePath::kCpu) {
      out.push_back({path, backends.empty() ? std::nullopt : std::optional(backends.front())});
      continue;
    }
    for (const Backend backend : backends) out.push_back({path, backend});
  }
  if (out.empty())
    return fail(ErrorCode::kEnvironment,
                "--composite " + composite + ": there is no GL on this machine");
  return out;
}

}  // namespace

Result<MeasureSweep> parse_measure_sweep(const MeasureSweepText& text, bool one_file,
                                         const std::vector<Backend>& backends) {
  const auto or_else = [one_file](const std::string& given, const char* one, const char* several) {
    return !given.empty() ? given : std::string(one_file ? one : several);
  };
  std::vector<Backend> used = backends;
  if (!text.backend.empty()) {
    RELIT_ASSIGN(const std::vector<std::string> names, words(text.backend, "--backend"));
    used.clear();
    for (const std::string& name : names) {
      RELIT_ASSIGN(const Backend backend, parse_backend(name));
      if (backend == Backend::kCpu)
        return fail(ErrorCode::kInvalid, "--backend cpu: that is a path: --composite cpu");
      if (std::find(backends.begin(), backends.end(), backend) == backends.end())
        return fail(ErrorCode::kEnvironment, "--backend " + name + ": not on this machine");
      used.push_back(backend);
    }
  }
  MeasureSweep sweep;
  sweep.product = text.product;
  RELIT_ASSIGN(sweep.planes, plane_words(or_else(text.planes, "all,layers,1", "all")));
  const bool gl = !used.empty();
  RELIT_ASSIGN(sweep.paths,
               paths_of(or_else(text.composite, gl ? "cpu,texture,fused" : "cpu", "cpu"), used));
  RELIT_ASSIGN(const auto threads, numbers(or_else(text.threads, "1,2", "1"), "--threads", 64));
  sweep.threads.assign(threads.begin(), threads.end());
  RELIT_ASSIGN(sweep.every, numbers(or_else(text.every, "1,2,4", "1"), "--every", 1000));
  return sweep;
}

namespace {

Result<std::vector<int>> planes_of(const MeasureSweep& sweep, const MeasuredFile& file) {
  std::vector<int> out;
  const int all = file.planes();
  for (const std::string& word : sweep.planes) {
    std::uint64_t value = static_cast<std::uint64_t>(all);
    if (word == "layers") {
      int end = 0;
      std::vector<int> ends;
      for (const MeasuredFile::Layer& layer : file.layers) ends.push_back(end += layer.planes);
      out.insert(out.end(), ends.rbegin(), ends.rend());
      continue;
    }
    if (word != "all") parse_number(word, value);
    if (value > static_cast<std::uint64_t>(all))
      return fail(ErrorCode::kInvalid,
                  "--planes " + word + ": " + file.path + " has " + std::to_string(all));
    out.push_back(static_cast<int>(value));
  }
  return out;
}

}  // namespace

Result<std::vector<MeasureKnobs>> expand_measure_sweep(const MeasureSweep& sweep,
                                                       const MeasuredFile& file) {
  RELIT_ASSIGN(const std::vector<int> planes, planes_of(sweep, file));
  std::vector<MeasureKnobs> points;
  MeasureKnobs base;
  base.planes = planes.front();
  base.path = sweep.paths.front().path, base.backend = sweep.paths.front().backend;
  base.threads = sweep.threads.front();
  base.every = sweep.every.front();
  points.push_back(base);
  const auto add = [&](const MeasureKnobs& knobs) {
    if (std::find(points.begin(), points.end(), knobs) == points.end()) points.push_back(knobs);
  };
  // Every value of a knob, of the base or of all points so far.
  const auto vary = [&](const auto& values, const auto& set) {
    const std::vector<MeasureKnobs> from = sweep.product ? points : std::vector{base};
    for (const auto& value : values) {
      for (MeasureKnobs knobs : from) {
        set(knobs, value);
        add(knobs);
      }
    }
  };
  vary(planes, [](MeasureKnobs& k, int value) { k.planes = value; });
  vary(sweep.paths, [](MeasureKnobs& k, const MeasureSweep::Path& value) {
    k.path = value.path, k.backend = value.backend;
  });
  vary(sweep.threads, [](MeasureKnobs& k, int value) { k.threads = value; });
  vary(sweep.every, [](MeasureKnobs& k, std::uint64_t value) { k.every = value; });
  return points;
}

}  // namespace relit::player
