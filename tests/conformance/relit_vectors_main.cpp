// SPDX-License-Identifier: MIT
// relit-vectors FOLDER: writes the conformance vectors, each with its expectations beside it.
#include <meshoptimizer.h>
#include <zstd.h>

#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>

extern "C" {
#include <libavutil/avutil.h>
}

#include "player/file_survey.hpp"
#include "tests/conformance/frames.hpp"
#include "tests/conformance/vector.hpp"

namespace relit::conformance {

Vectors all_vectors() {
  Vectors vectors;
  add_codings(vectors);
  add_structures(vectors);
  add_damage(vectors);
  add_payloads(vectors);
  add_references(vectors);
  add_contents(vectors);
  std::set<std::string> names;
  for (const Vector& vector : vectors) {
    if (!names.insert(vector.name).second)
      throw std::logic_error("two vectors are called " + vector.name);
  }
  return vectors;
}

namespace {

using nlohmann::ordered_json;

const char* outcome_name(Outcome outcome) {
  switch (outcome) {
    case Outcome::kWhole:
      return "whole";
    case Outcome::kLossy:
      return "lossy";
    case Outcome::kRefused:
      return "refused";
  }
  return "?";
}

/// The members of an object on a line each, and so those of `info` and `frames`: small, and a
/// change still shows where it is.
void print(const ordered_json& json, std::size_t depth, std::string& out) {
  if (!json.is_object() || json.empty() || depth > 1) {
    out += json.dump();
    return;
  }
  const char* before = "{\n";
  for (const auto& [key, value] : json.items()) {
    out += before + ordered_json(key).dump() + ":";
    print(value, depth + 1, out);
    before = ",\n";
  }
  out += "}";
}

std::unique_ptr<container::ByteSource> memory(const Bytes& bytes) {
  return std::make_unique<container::MemorySource>(std::span<const std::uint8_t>(bytes));
}

/// What relit makes of the bytes must be what the vector is meant to show.
void expect(bool condition, const std::string& what) {
  if (!condition) throw std::runtime_error(what);
}

ordered_json expectations(const Vector& vector, const Bytes& bytes) {
  ordered_json json{{"name", vector.name},
                    {"description", vector.description},
                    {"valid", vector.valid},
                    {"outcome", outcome_name(vector.outcome)},
                    {"findings", vector.findings}};
  const auto survey = player::survey_file(memory(bytes), true);
  const Outcome seen = !survey                  ? Outcome::kRefused
                       : survey->damage.empty() ? Outcome::kWhole
                                                : Outcome::kLossy;
  expect(seen == vector.outcome, std::string("it is ") + outcome_name(seen) + ", not " +
                                     outcome_name(vector.outcome) + ": " +
                                     (survey ? survey->damage : survey.error().message));
  json["info"] = nullptr;
  if (vector.valid && seen == Outcome::kWhole) json["info"] = player::survey_json(*survey);
  json["frames"] = nullptr;
  if (seen == Outcome::kRefused) return json;
  auto frames = decode_frames(memory(bytes));
  expect(frames.has_value() == vector.decodes,
         frames ? "it decodes" : "it does not decode: " + frames.error().message);
  if (frames) json["frames"] = std::move(*frames);
  return json;
}

void write(const std::filesystem::path& path, std::string_view bytes) {
  std::ofstream out(path, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!out.flush()) throw std::runtime_error("cannot write " + path.string());
}

void write_vector(const Vector& vector, const std::filesystem::path& folder) {
  const Bytes bytes = vector.make();
  std::string text;
  print(expectations(vector, bytes), 0, text);
  write(folder / (vector.name + ".relit"),
        {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  write(folder / (vector.name + ".json"), text + "\n");
}

/// The libraries whose bytes the vectors hold.
void write_tools(const std::filesystem::path& folder) {
  const ordered_json tools{{"ffmpeg", av_version_info()},
                           {"zstd", ZSTD_versionString()},
                           {"meshoptimizer", MESHOPTIMIZER_VERSION}};
  write(folder / "TOOLS.json", tools.dump(1) + "\n");
}

int run(const std::filesystem::path& folder, const std::string& only) {
  std::filesystem::create_directories(folder);
  write_tools(folder);
  int written = 0, failed = 0;
  for (const Vector& vector : all_vectors()) {
    if (vector.name.rfind(only, 0) != 0) continue;
    try {
      write_vector(vector, folder);
      ++written;
    } catch (const std::exception& error) {
      std::fprintf(stderr, "relit-vectors: %s: %s\n", vector.name.c_str(), error.what());
      ++failed;
    }
  }
  std::fprintf(stderr, "relit-vectors: %d written to %s, %d failed\n", written, folder.c_str(),
               failed);
  return failed == 0 ? 0 : 1;
}

}  // namespace
}  // namespace relit::conformance

int main(int argc, char** argv) {
  if (argc != 2 && argc != 3) {
    std::fprintf(stderr, "usage: relit-vectors FOLDER [FIRST LETTERS OF A NAME]\n");
    return 2;
  }
  try {
    return relit::conformance::run(argv[1], argc == 3 ? argv[2] : "");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "relit-vectors: %s\n", error.what());
    return 1;
  }
}
