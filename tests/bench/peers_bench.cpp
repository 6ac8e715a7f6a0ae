// SPDX-License-Identifier: MIT
// What else a bake could be stored as, scored as relit files are (tests/bench/peers drives this).
//
//   peers_bench exr REFERENCE MASK        half-float OpenEXR, a file a frame, by compression
//   peers_bench zstd REFERENCE MASK       half floats, a zstd frame each
//   peers_bench pack REFERENCE FORMAT     raw video to standard output
//   peers_bench score REFERENCE MASK FORMAT    raw video from standard input against the reference
//
// FORMAT is yuv420p10le or yuv444p10le (signed logarithm around 512, Y Co Cg), or rgb48le (linear
// around 32768). A picture is the grid of all coefficients' tiles. Prints one JSON object a line.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStdIO.h>
#include <ImfThreading.h>
#include <half.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "decoders/npy.hpp"
#include "decoders/relit_error.hpp"

using relit::decoders::NpyArray;

namespace {

[[noreturn]] void stop(const std::string& why) {
  std::fprintf(stderr, "peers_bench: %s\n", why.c_str());
  std::exit(1);
}

/// [frames][coefficients][3][height][width]
struct Clip {
  NpyArray array;
  std::size_t frames = 0, coefficients = 0, height = 0, width = 0;

  [[nodiscard]] std::size_t texels() const { return height * width; }
  [[nodiscard]] std::size_t planes() const { return 3 * coefficients; }
  [[nodiscard]] std::size_t frame_size() const { return planes() * texels(); }
  [[nodiscard]] std::span<const float> frame(std::size_t k) const {
    return std::span(array.values).subspan(k * frame_size(), frame_size());
  }
};

NpyArray load(const char* path) {
  auto array = relit::decoders::read_npy(path);
  if (!array) stop(array.error().message);
  return std::move(*array);
}

Clip load_clip(const char* path) {
  Clip clip;
  clip.array = load(path);
  const auto& s = clip.array.shape;
  if (s.size() != 5 || s[2] != 3) stop(std::string(path) + " is no reference of a bake");
  clip.frames = s[0], clip.coefficients = s[1], clip.height = s[3], clip.width = s[4];
  return clip;
}

/// Scores frames as they come, and the time that decoding took.
class Score {
 public:
  Score(const Clip& clip, const char* mask)
      : clip_(&clip),
        error_(relit::decoders::standard_lights(), static_cast<int>(clip.coefficients),
               covered(mask, clip)) {}

  void add(std::size_t frame, std::span<const float> decoded) {
    error_.add_frame(clip_->frame(frame), decoded);
  }
  template <class Work>
  void time(const Work& work) {
    const auto begin = std::chrono::steady_clock::now();
    work();
    seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  }
  void print(const std::string& name, std::size_t bytes) const {
    const auto figures = error_.figures();
    std::printf("{\"name\": \"%s\", \"bytes\": %zu, \"psnr_db\": %.3f, \"decode_ms\": %.3f}\n",
                name.c_str(), bytes, std::min(figures.psnr_db, 999.0),
                1e3 * seconds_ / static_cast<double>(clip_->frames));
  }

 private:
  static std::vector<std::uint8_t> covered(const char* path, const Clip& clip) {
    const NpyArray mask = load(path);
    if (mask.values.size() != clip.texels()) stop(std::string(path) + " is of another size");
    std::vector<std::uint8_t> out(mask.values.size());
    for (std::size_t p = 0; p < out.size(); ++p) out[p] = mask.values[p] > 0 ? 1 : 0;
    return out;
  }

  const Clip* clip_;
  relit::decoders::RelitError error_;
  double seconds_ = 0;
};

std::vector<half> halves(std::span<const float> values) {
  std::vector<half> out(values.size());
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = half(values[i]);
  return out;
}

Imf::FrameBuffer frame_buffer(const Clip& clip, half* planes) {
  Imf::FrameBuffer buffer;
  for (std::size_t p = 0; p < clip.planes(); ++p) {
    char name[40];
    std::snprintf(name, sizeof name, "T%02zu.%c", p / 3, "RGB"[p % 3]);
    buffer.insert(name, Imf::Slice(Imf::HALF, reinterpret_cast<char*>(planes + p * clip.texels()),
                                   sizeof(half), sizeof(half) * clip.width));
  }
  return buffer;
}

struct ExrSetting {
  std::string name;
  Imf::Compression compression;
  float level = 0;  ///< of DWA: the square root of the quantiser's step, about
};

void score_exr(const Clip& clip, const char* mask, const ExrSetting& setting) {
  Score score(clip, mask);
  std::size_t bytes = 0;
  std::vector<half> planes(clip.frame_size());
  std::vector<float> decoded(clip.frame_size());
  for (std::size_t k = 0; k < clip.frames; ++k) {
    Imf::Header header(static_cast<int>(clip.width), static_cast<int>(clip.height));
    header.compression() = setting.compression;
    if (setting.level > 0) header.dwaCompressionLevel() = setting.level;
    planes = halves(clip.frame(k));
    const Imf::FrameBuffer buffer = frame_buffer(clip, planes.data());
    for (auto i = buffer.begin(); i != buffer.end(); ++i)
      header.channels().insert(i.name(), Imf::Channel(Imf::HALF));
    Imf::StdOSStream out;
    {
      Imf::OutputFile file(out, header, 0);
      file.setFrameBuffer(buffer);
      file.writePixels(static_cast<int>(clip.height));
    }
    bytes += out.str().size();
    Imf::StdISStream in;
    in.str(out.str());
    score.time([&] {
      Imf::InputFile file(in, 0);
      file.setFrameBuffer(buffer);
      file.readPixels(0, static_cast<int>(clip.height) - 1);
    });
    std::copy(planes.begin(), planes.end(), decoded.begin());
    score.add(k, decoded);
  }
  score.print("exr " + setting.name, bytes);
}

void score_zstd(const Clip& clip, const char* mask) {
  Score score(clip, mask);
  std::size_t bytes = 0;
  std::vector<float> decoded(clip.frame_size());
  for (std::size_t k = 0; k < clip.frames; ++k) {
    std::vector<half> planes = halves(clip.frame(k));
    const std::size_t size = planes.size() * sizeof(half);
    std::vector<char> packed(ZSTD_compressBound(size));
    const std::size_t used = ZSTD_compress(packed.data(), packed.size(), planes.data(), size, 19);
    if (ZSTD_isError(used) != 0) stop("zstd fails");
    bytes += used;
    score.time([&] {
      if (ZSTD_decompress(planes.data(), size, packed.data(), used) != size) stop("zstd fails");
    });
    std::copy(planes.begin(), planes.end(), decoded.begin());
    score.add(k, decoded);
  }
  score.print("half + zstd", bytes);
}

/// Raw video of the tiles of all coefficients, near square.
class Grid {
 public:
  Grid(const Clip& clip, std::string_view format) : clip_(&clip), rgb_(format == "rgb48le") {
    if (format == "yuv420p10le") {
      shift_ = 1;
    } else if (!rgb_ && format != "yuv444p10le") {
      stop("unknown format " + std::string(format));
    }
    columns_ =
        static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(clip.coefficients))));
    const std::size_t rows = (clip.coefficients + columns_ - 1) / columns_;
    width_ = (columns_ * clip.width + shift_) >> shift_ << shift_;
    height_ = (rows * clip.height + shift_) >> shift_ << shift_;
    for (const float value : clip.array.values) range_ = std::max(range_, std::abs(value));
    if (range_ == 0) range_ = 1;
  }

  [[nodiscard]] std::size_t width() const { return width_; }
  [[nodiscard]] std::size_t height() const { return height_; }
  [[nodiscard]] std::size_t samples() const {
    const std::size_t luma = width_ * height_;
    return rgb_ ? 3 * luma : luma + 2 * (luma >> (2 * shift_));
  }

  void pack(std::span<const float> frame, std::vector<std::uint16_t>& out) const {
    out.assign(samples(), rgb_ ? 32768 : 512);
    std::vector<std::array<double, 3>> picture(width_ * height_, neutral());
    for_each_texel([&](std::size_t n, std::size_t p, std::size_t at) {
      std::array<double, 3> code{};
      for (std::size_t c = 0; c < 3; ++c)
        code[c] = to_code(static_cast<double>(frame[(3 * n + c) * clip_->texels() + p]));
      picture[at] = rgb_ ? code : to_ycocg(code);
    });
    store(picture, out);
  }

  void unpack(std::span<const std::uint16_t> in, std::span<float> frame) const {
    for_each_texel([&](std::size_t n, std::size_t p, std::size_t at) {
      std::array<double, 3> code{};
      for (std::size_t c = 0; c < 3; ++c) code[c] = fetch(in, c, at);
      if (!rgb_) code = to_rgb(code);
      for (std::size_t c = 0; c < 3; ++c)
        frame[(3 * n + c) * clip_->texels() + p] = static_cast<float>(from_code(code[c]));
    });
  }

 private:
  // A decade of the logarithm: dark values get steps a tenth of those of bright ones.
  static constexpr double kCurve = 10;

  [[nodiscard]] std::array<double, 3> neutral() const {
    const double middle = rgb_ ? 32768 : 512;
    return {middle, middle, middle};
  }
  [[nodiscard]] double to_code(double value) const {
    const double v = value / static_cast<double>(range_);
    if (rgb_) return 32768 + 32767 * v;
    return 512 + std::copysign(511 * std::log1p(kCurve * std::abs(v)) / std::log1p(kCurve), v);
  }
  [[nodiscard]] double from_code(double code) const {
    const double range = static_cast<double>(range_);
    if (rgb_) return (code - 32768) / 32767 * range;
    const double v = (code - 512) / 511;
    return std::copysign(std::expm1(std::abs(v) * std::log1p(kCurve)) / kCurve, v) * range;
  }
  static std::array<double, 3> to_ycocg(const std::array<double, 3>& c) {
    const auto [r, g, b] = c;
    return {(r + 2 * g + b) / 4, (r - b) / 2 + 512, (2 * g - r - b) / 4 + 512};
  }
  static std::array<double, 3> to_rgb(const std::array<double, 3>& c) {
    const double y = c[0], co = c[1] - 512, cg = c[2] - 512;
    return {y + co - cg, y + cg, y - co - cg};
  }
  void for_each_texel(
      const std::function<void(std::size_t, std::size_t, std::size_t)>& visit) const {
    for (std::size_t n = 0; n < clip_->coefficients; ++n) {
      const std::size_t x0 = n % columns_ * clip_->width, y0 = n / columns_ * clip_->height;
      for (std::size_t p = 0; p < clip_->texels(); ++p)
        visit(n, p, (y0 + p / clip_->width) * width_ + x0 + p % clip_->width);
    }
  }
  void store(std::span<const std::array<double, 3>> picture,
             std::vector<std::uint16_t>& out) const {
    const double top = rgb_ ? 65535 : 1023;
    const auto rounded = [&](double v) {
      return static_cast<std::uint16_t>(std::lround(std::clamp(v, 0.0, top)));
    };
    for (std::size_t at = 0; at < picture.size(); ++at) {
      if (rgb_) {
        for (std::size_t c = 0; c < 3; ++c) out[3 * at + c] = rounded(picture[at][c]);
        continue;
      }
      out[at] = rounded(picture[at][0]);
    }
    if (rgb_) return;
    const std::size_t side = std::size_t{1} << shift_;
    for (std::size_t c = 1; c < 3; ++c) {
      for (std::size_t y = 0; y < height_; y += side) {
        for (std::size_t x = 0; x < width_; x += side) {
          double sum = 0;
          for (std::size_t i = 0; i < side * side; ++i)
            sum += picture[(y + i / side) * width_ + x + i % side][c];
          out[chroma(c, y * width_ + x)] = rounded(sum / static_cast<double>(side * side));
        }
      }
    }
  }
  [[nodiscard]] std::size_t chroma(std::size_t component, std::size_t at) const {
    const std::size_t luma = width_ * height_, plane = luma >> (2 * shift_);
    const std::size_t y = at / width_ >> shift_, x = at % width_ >> shift_;
    return luma + (component - 1) * plane + y * (width_ >> shift_) + x;
  }
  [[nodiscard]] double fetch(std::span<const std::uint16_t> in, std::size_t component,
                             std::size_t at) const {
    if (rgb_) return in[3 * at + component];
    return component == 0 ? in[at] : in[chroma(component, at)];
  }

  const Clip* clip_;
  bool rgb_;
  unsigned shift_ = 0;
  std::size_t columns_ = 0, width_ = 0, height_ = 0;
  float range_ = 0;
};

void pack(const Clip& clip, std::string_view format) {
  const Grid grid(clip, format);
  std::fprintf(stderr, "%zux%zu\n", grid.width(), grid.height());
  std::vector<std::uint16_t> samples;
  for (std::size_t k = 0; k < clip.frames; ++k) {
    grid.pack(clip.frame(k), samples);
    if (std::fwrite(samples.data(), 2, samples.size(), stdout) != samples.size())
      stop("standard output cannot be written");
  }
}

void score_raw(const Clip& clip, const char* mask, std::string_view format) {
  const Grid grid(clip, format);
  Score score(clip, mask);
  std::vector<std::uint16_t> samples(grid.samples());
  std::vector<float> decoded(clip.frame_size());
  for (std::size_t k = 0; k < clip.frames; ++k) {
    if (std::fread(samples.data(), 2, samples.size(), stdin) != samples.size())
      stop("frame " + std::to_string(k) + " is missing");
    grid.unpack(samples, decoded);
    score.add(k, decoded);
  }
  score.print("", 0);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view what = argc > 1 ? argv[1] : "";
  if (what == "exr" && argc == 4) {
    const Clip clip = load_clip(argv[2]);
    Imf::setGlobalThreadCount(0);
    for (const ExrSetting& setting :
         {ExrSetting{"zip", Imf::ZIP_COMPRESSION}, ExrSetting{"piz", Imf::PIZ_COMPRESSION},
          ExrSetting{"dwaa 45", Imf::DWAA_COMPRESSION, 45},
          ExrSetting{"dwaa 500", Imf::DWAA_COMPRESSION, 500},
          ExrSetting{"dwaa 4000", Imf::DWAA_COMPRESSION, 4000},
          ExrSetting{"dwaa 30000", Imf::DWAA_COMPRESSION, 30000},
          ExrSetting{"dwaa 200000", Imf::DWAA_COMPRESSION, 200000}})
      score_exr(clip, argv[3], setting);
  } else if (what == "zstd" && argc == 4) {
    score_zstd(load_clip(argv[2]), argv[3]);
  } else if (what == "pack" && argc == 4) {
    pack(load_clip(argv[2]), argv[3]);
  } else if (what == "score" && argc == 5) {
    score_raw(load_clip(argv[2]), argv[3], argv[4]);
  } else {
    std::fprintf(stderr,
                 "usage: peers_bench exr|zstd REFERENCE MASK\n"
                 "       peers_bench pack REFERENCE FORMAT >RAW\n"
                 "       peers_bench score REFERENCE MASK FORMAT <RAW\n");
    return 2;
  }
  return 0;
}
