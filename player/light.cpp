// SPDX-License-Identifier: MIT
#include "player/light.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <new>

#include "container/base/limits.hpp"
#include "player/light_file.hpp"

namespace relit::player {
namespace {

constexpr std::uint64_t kPictureBytes = 512ull << 20;
constexpr std::uint64_t kJsonBytes = 4ull << 20;

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

Unexpected io_error(const char* what) {
  return fail(ErrorCode::kIo, std::string(what) + ": " + std::strerror(errno));
}

/// The whole file, which may be a pipe: then its size shows only as it is read.
Result<std::vector<std::uint8_t>> read_file(const std::string& path) {
  const auto too_large = [] {
    return fail(ErrorCode::kLimit, "the file is larger than a light's may be, " +
                                       std::to_string(kPictureBytes >> 20) + " MiB");
  };
  const File file(std::fopen(path.c_str(), "rb"));
  if (!file) return io_error("cannot be opened");
  std::error_code unknown;
  const std::uintmax_t size = std::filesystem::file_size(path, unknown);
  if (!unknown && size > kPictureBytes) return too_large();
  std::vector<std::uint8_t> bytes(unknown ? 65536 : static_cast<std::size_t>(size) + 1);
  std::size_t filled = 0;
  while (true) {
    const std::size_t count =
        std::fread(bytes.data() + filled, 1, bytes.size() - filled, file.get());
    filled += count;
    if (filled > kPictureBytes) return too_large();
    if (count == 0) break;
    if (filled == bytes.size()) bytes.resize(2 * filled);
  }
  if (std::ferror(file.get()) != 0) return io_error("cannot be read");
  bytes.resize(filled);
  return bytes;
}

enum class Format { kHdr, kExr, kJson, kUnknown };

Format format_of(const std::string& path, std::span<const std::uint8_t> bytes) {
  if (is_hdr(bytes)) return Format::kHdr;
  if (is_exr(bytes)) return Format::kExr;
  const auto first = std::find_if(bytes.begin(), bytes.end(), [](std::uint8_t byte) {
    return byte != ' ' && byte != '\t' && byte != '\r' && byte != '\n';
  });
  if (first != bytes.end() && *first == '{') return Format::kJson;
  std::string suffix = std::filesystem::path(path).extension().string();
  for (char& letter : suffix) {
    if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter - 'A' + 'a');
  }
  if (suffix == ".hdr") return Format::kHdr;
  if (suffix == ".exr") return Format::kExr;
  if (suffix == ".json") return Format::kJson;
  return Format::kUnknown;
}

Status check_options(const LightOptions& options) {
  if (options.order < 0 || options.order > static_cast<int>(limits::kShOrder)) {
    return fail(ErrorCode::kInvalid,
                "the order of a light must be 0 to 3, not " + std::to_string(options.order));
  }
  if (!std::isfinite(options.rotate_rad)) {
    return fail(ErrorCode::kInvalid, "the angle by which to turn a light is not finite");
  }
  return {};
}

/// Reads whichever format it is and sets light, field and environment.
Status read_light(const std::string& path, const LightOptions& options, LoadedLight& loaded) {
  RELIT_ASSIGN(const std::vector<std::uint8_t> bytes, read_file(path));
  if (bytes.empty()) return fail(ErrorCode::kTruncated, "the file is empty");
  decoders::Environment picture;
  switch (format_of(path, bytes)) {
    case Format::kUnknown:
      return fail(ErrorCode::kUnsupported,
                  "neither a Radiance .hdr nor an OpenEXR .exr nor a .json light");
    case Format::kJson: {
      if (bytes.size() > kJsonBytes) {
        return fail(ErrorCode::kLimit, "a .json light is larger than 4 MiB");
      }
      RELIT_ASSIGN(LightField field, read_light_field(bytes));
      field.transform(options.order, options.rotate_rad, options.window);
      loaded.light = field.parts().lights[0];
      if (field.varies_in_time() || field.varies_in_space()) {
        loaded.light = field.mean();
        loaded.field = std::move(field);
      }
      return {};
    }
    case Format::kHdr: {
      RELIT_ASSIGN(picture, read_hdr(bytes));
      break;
    }
    case Format::kExr: {
      RELIT_ASSIGN(picture, read_exr(bytes, loaded.warnings));
      break;
    }
  }
  loaded.environment = std::make_shared<const decoders::Environment>(std::move(picture));
  const decoders::Environment& environment = *loaded.environment;
  RELIT_ASSIGN(loaded.light, decoders::project_environment(environment, options.order));
  if (environment.width != 2 * environment.height) {
    loaded.warnings.push_back("the picture is " + std::to_string(environment.width) + "x" +
                              std::to_string(environment.height) +
                              ", not twice as wide as high; it is stretched over the whole sphere");
  }
  loaded.environment_rotation_rad = options.rotate_rad;
  decoders::rotate_light_y(loaded.light, options.rotate_rad);
  if (options.window) decoders::window_light(loaded.light);
  return {};
}

}  // namespace

Status check_picture_size(std::int64_t width, std::int64_t height) {
  const std::string size = std::to_string(width) + "x" + std::to_string(height);
  if (width < 1 || height < 1) return fail(ErrorCode::kCorrupt, "a picture of " + size + " pixels");
  constexpr auto kSide = std::int64_t{limits::kImageSide};
  constexpr auto kTexels = static_cast<std::int64_t>(limits::kImageTexels);
  if (width > kSide || height > kSide || width * height > kTexels) {
    return fail(ErrorCode::kLimit, "a picture of " + size + " pixels; a side may have " +
                                       std::to_string(kSide) + ", the whole " +
                                       std::to_string(kTexels));
  }
  return {};
}

Result<LoadedLight> load_light(const std::string& path, const LightOptions& options) {
  RELIT_TRY(check_options(options));
  LoadedLight loaded;
  loaded.name = std::filesystem::path(path).stem().string();
  Status status;
  try {
    status = read_light(path, options, loaded);
  } catch (const std::bad_alloc&) {
    status = fail(ErrorCode::kOutOfMemory, "not enough memory for the picture");
  }
  if (!status) return fail(status.error().code, path + ": " + status.error().message);
  for (std::string& warning : loaded.warnings) warning = path + ": " + warning;
  loaded.minimum_radiance = decoders::minimum_radiance(loaded.light);
  return loaded;
}

namespace {

Status write_text(const std::string& path, const std::string& text) {
  File file(std::fopen(path.c_str(), "wb"));
  const bool written = file && std::fwrite(text.data(), 1, text.size(), file.get()) == text.size();
  const bool closed = file && std::fclose(file.release()) == 0;  // a full disk may show only here
  if (written && closed) return {};
  return fail(ErrorCode::kIo, path + ": cannot be written: " + std::strerror(errno));
}

}  // namespace

Status write_light_json(const std::string& path, const decoders::Light& light) {
  RELIT_ASSIGN(const std::string text, light_json(light));
  return write_text(path, text);
}

Status write_light_json(const std::string& path, const LightField& field) {
  return write_text(path, light_field_json(field));
}

}  // namespace relit::player
