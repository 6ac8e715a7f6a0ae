// SPDX-License-Identifier: MIT
// MODL, LAYR.
#include <algorithm>
#include <bit>

#include "container/base/bytes.hpp"
#include "container/record_checks.hpp"
#include "container/record_codec.hpp"

namespace relit::container {

using namespace checks;

namespace {

constexpr std::size_t kRectBytes = 8;
constexpr std::size_t kEntryBytes = 1 + 1 + 4;
constexpr std::size_t kPlaneLeastBytes = 1 + kRectBytes + 4 + 4;
constexpr std::uint32_t kMatrixEntries = 3 * limits::kCoefficients;

void write(ByteWriter& w, const Rect& rect) {
  w.u16(rect.x);
  w.u16(rect.y);
  w.u16(rect.width);
  w.u16(rect.height);
}

Rect read_rect(ByteReader& r, const char* what) {
  Rect rect;
  rect.x = r.u16(what);
  rect.y = r.u16(what);
  rect.width = r.u16(what);
  rect.height = r.u16(what);
  return rect;
}

bool inside(const Rect& rect, std::uint16_t width, std::uint16_t height) {
  return rect.width > 0 && rect.height > 0 && rect.x + rect.width <= width &&
         rect.y + rect.height <= height;
}

bool overlap(const Rect& a, const Rect& b) {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

Status codec_name(const std::string& name, const char* what) {
  RELIT_TRY(one_to(name.size(), limits::kCodecNameBytes, what));
  const bool good = std::ranges::all_of(name, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
  RELIT_REQUIRE(good, std::string(what) + " has other characters than a-z, 0-9, _ and -");
  return {};
}

}  // namespace

std::vector<std::uint8_t> serialize(const ModelRecord& record) {
  ByteWriter w;
  w.u32(record.id);
  w.u32(record.clip_id);
  w.u8(static_cast<std::uint8_t>(record.kind));
  w.u8(record.order);
  w.u16(record.width);
  w.u16(record.height);
  w.i32(record.prediction_plane);
  w.u32(static_cast<std::uint32_t>(record.mean.size()));
  for (const Rgb& mean : record.mean) w.f32s(mean);
  return w.take();
}

Result<ModelRecord> parse_model(std::span<const std::uint8_t> payload) {
  ByteReader r(payload);
  ModelRecord record;
  record.id = r.u32("id");
  record.clip_id = r.u32("clip_id");
  record.kind = r.enumeration("kind", ModelKind::kShLightMap);
  record.order = r.u8("order");
  record.width = r.u16("width");
  record.height = r.u16("height");
  record.prediction_plane = r.i32("prediction_plane");
  record.mean.resize(r.count("mean", limits::kCoefficients, 12));
  for (Rgb& mean : record.mean) mean = r.f32s<3>("mean");
  RELIT_TRY(r.finish());
  RELIT_TRY(validate(record));
  return record;
}

Status validate(const ModelRecord& record) {
  RELIT_TRY(known(record.kind, ModelKind::kShLightMap, "kind"));
  RELIT_TRY(at_most(record.order, limits::kShOrder, "order"));
  RELIT_TRY(one_to(record.width, limits::kLightMapSide, "width"));
  RELIT_TRY(one_to(record.height, limits::kLightMapSide, "height"));
  RELIT_REQUIRE(
      record.prediction_plane >= -1 && record.prediction_plane < static_cast<int>(limits::kPlanes),
      "prediction_plane is neither -1 nor the number of a plane");
  const std::size_t coefficients = (record.order + 1u) * (record.order + 1u);
  RELIT_REQUIRE(record.mean.size() == coefficients,
                "mean has " + std::to_string(record.mean.size()) + " entries, order " +
                    std::to_string(record.order) + " needs " + std::to_string(coefficients));
  for (const Rgb& mean : record.mean) RELIT_TRY(finite(mean, "mean"));
  return {};
}

std::vector<std::uint8_t> serialize(const LayerRecord& record) {
  ByteWriter w;
  w.u32(record.id);
  w.u32(record.model_id);
  w.u32(record.mantissa_track);
  w.string(record.codec);
  w.bytes(record.codec_private);
  w.u16(record.coded_width);
  w.u16(record.coded_height);
  w.u8(record.bit_depth);
  w.u8(static_cast<std::uint8_t>(record.chroma));
  w.boolean(record.lossless);
  w.u8(record.mantissa_pictures);
  w.boolean(record.has_exponents);
  if (record.has_exponents) {
    w.u32(record.exponent_track);
    w.string(record.exponent_codec);
    w.bytes(record.exponent_private);
    w.u16(record.exponent_width);
    w.u16(record.exponent_height);
    w.u8(record.exponent_block);
    w.u8(record.exponent_pictures);
  }
  w.u32(static_cast<std::uint32_t>(record.planes.size()));
  for (const PlaneRecord& p : record.planes) {
    w.u8(p.component);
    write(w, p.mantissa_rect);
    if (record.has_exponents) write(w, p.exponent_rect);
    w.f32(p.scale);
    w.u32(static_cast<std::uint32_t>(p.matrix.size()));
    for (const MatrixEntry& m : p.matrix) {
      w.u8(m.coefficient);
      w.u8(m.channel);
      w.f32(m.value);
    }
  }
  return w.take();
}

namespace {

void read_exponents(ByteReader& r, LayerRecord& record) {
  record.exponent_track = r.u32("exponent_track");
  record.exponent_codec = r.string("exponent_codec", limits::kCodecNameBytes);
  record.exponent_private = r.bytes("exponent_private", limits::kCodecPrivateBytes);
  record.exponent_width = r.u16("exponent_width");
  record.exponent_height = r.u16("exponent_height");
  record.exponent_block = r.u8("exponent_block");
  record.exponent_pictures = r.u8("exponent_pictures");
}

void read_planes(ByteReader& r, LayerRecord& record) {
  record.planes.resize(r.count("planes", limits::kPlanes, kPlaneLeastBytes));
  for (PlaneRecord& p : record.planes) {
    p.component = r.u8("plane.component");
    p.mantissa_rect = read_rect(r, "plane.mantissa_rect");
    if (record.has_exponents) p.exponent_rect = read_rect(r, "plane.exponent_rect");
    p.scale = r.f32("plane.scale");
    p.matrix.resize(r.count("plane.matrix", kMatrixEntries, kEntryBytes));
    for (MatrixEntry& m : p.matrix) {
      m.coefficient = r.u8("matrix.coefficient");
      m.channel = r.u8("matrix.channel");
      m.value = r.f32("matrix.value");
    }
  }
}

}  // namespace

Result<LayerRecord> parse_layer(std::span<const std::uint8_t> payload) {
  ByteReader r(payload);
  LayerRecord record;
  record.id = r.u32("id");
  record.model_id = r.u32("model_id");
  record.mantissa_track = r.u32("mantissa_track");
  record.codec = r.string("codec", limits::kCodecNameBytes);
  record.codec_private = r.bytes("codec_private", limits::kCodecPrivateBytes);
  record.coded_width = r.u16("coded_width");
  record.coded_height = r.u16("coded_height");
  record.bit_depth = r.u8("bit_depth");
  record.chroma = r.enumeration("chroma", Chroma::k444);
  record.lossless = r.boolean("lossless");
  record.mantissa_pictures = r.u8("mantissa_pictures");
  record.has_exponents = r.boolean("has_exponents");
  if (record.has_exponents) read_exponents(r, record);
  read_planes(r, record);
  RELIT_TRY(r.finish());
  RELIT_TRY(validate(record));
  return record;
}

namespace {

Status validate_exponents(const LayerRecord& record) {
  RELIT_REQUIRE(record.exponent_track != record.mantissa_track,
                "exponent_track is the same as mantissa_track");
  RELIT_TRY(codec_name(record.exponent_codec, "exponent_codec"));
  RELIT_TRY(
      at_most(record.exponent_private.size(), limits::kCodecPrivateBytes, "exponent_private"));
  RELIT_TRY(one_to(record.exponent_width, limits::kVideoSide, "exponent_width"));
  RELIT_TRY(one_to(record.exponent_height, limits::kVideoSide, "exponent_height"));
  RELIT_TRY(one_to(record.exponent_pictures, limits::kDecoderPictures, "exponent_pictures"));
  RELIT_REQUIRE(
      std::has_single_bit(record.exponent_block) && record.exponent_block <= 32,
      "exponent_block " + std::to_string(record.exponent_block) + " is not 1, 2, 4, 8, 16 or 32");
  return {};
}

Status validate_matrix(const PlaneRecord& plane) {
  RELIT_TRY(at_most(plane.matrix.size(), kMatrixEntries, "number of matrix entries"));
  std::uint64_t seen = 0;
  for (const MatrixEntry& m : plane.matrix) {
    RELIT_REQUIRE(m.coefficient < limits::kCoefficients, "matrix.coefficient is not below 16");
    RELIT_REQUIRE(m.channel < 3, "matrix.channel is not 0, 1 or 2");
    RELIT_TRY(finite(m.value, "matrix.value"));
    const std::uint64_t bit = std::uint64_t{1} << (3 * m.coefficient + m.channel);
    RELIT_REQUIRE((seen & bit) == 0, "two matrix entries for the same coefficient and channel");
    seen |= bit;
  }
  return {};
}

Status validate_plane(const LayerRecord& layer, const PlaneRecord& plane) {
  const Rect& m = plane.mantissa_rect;
  RELIT_REQUIRE(plane.component < (layer.chroma == Chroma::kLuma ? 1 : 3),
                "component " + std::to_string(plane.component) + " does not exist");
  RELIT_REQUIRE(inside(m, layer.coded_width, layer.coded_height),
                "mantissa_rect is empty or leaves the coded picture");
  RELIT_TRY(at_most(m.width, limits::kLightMapSide, "mantissa_rect.width"));
  RELIT_TRY(at_most(m.height, limits::kLightMapSide, "mantissa_rect.height"));
  if (layer.chroma == Chroma::k420 && plane.component > 0)
    RELIT_REQUIRE(m.x % 2 == 0 && m.y % 2 == 0,
                  "mantissa_rect of a 4:2:0 chroma plane starts at an odd sample");
  if (layer.has_exponents) {
    const Rect& e = plane.exponent_rect;
    const int block = layer.exponent_block;
    RELIT_REQUIRE(inside(e, layer.exponent_width, layer.exponent_height),
                  "exponent_rect is empty or leaves the exponent picture");
    RELIT_REQUIRE(
        e.width == (m.width + block - 1) / block && e.height == (m.height + block - 1) / block,
        "exponent_rect does not have one sample for each exponent block");
  }
  RELIT_TRY(finite(plane.scale, "scale"));
  RELIT_REQUIRE(plane.scale > 0, "scale is not positive");
  return validate_matrix(plane);
}

}  // namespace

Status validate(const LayerRecord& record) {
  RELIT_TRY(codec_name(record.codec, "codec"));
  RELIT_TRY(at_most(record.codec_private.size(), limits::kCodecPrivateBytes, "codec_private"));
  RELIT_TRY(one_to(record.coded_width, limits::kVideoSide, "coded_width"));
  RELIT_TRY(one_to(record.coded_height, limits::kVideoSide, "coded_height"));
  RELIT_REQUIRE(record.bit_depth == 8 || record.bit_depth == 10,
                "bit_depth " + std::to_string(record.bit_depth) + " is neither 8 nor 10");
  RELIT_TRY(known(record.chroma, Chroma::k444, "chroma"));
  RELIT_TRY(one_to(record.mantissa_pictures, limits::kDecoderPictures, "mantissa_pictures"));
  if (record.has_exponents) RELIT_TRY(validate_exponents(record));
  RELIT_TRY(one_to(record.planes.size(), limits::kPlanes, "number of planes"));
  for (std::size_t i = 0; i < record.planes.size(); ++i) {
    const PlaneRecord& plane = record.planes[i];
    if (auto status = validate_plane(record, plane); !status)
      return fail(status.error().code,
                  "plane " + std::to_string(i) + ": " + status.error().message);
    for (std::size_t k = 0; k < i; ++k)
      RELIT_REQUIRE(record.planes[k].component != plane.component ||
                        !overlap(record.planes[k].mantissa_rect, plane.mantissa_rect),
                    "planes " + std::to_string(k) + " and " + std::to_string(i) + " overlap");
  }
  return {};
}

}  // namespace relit::container
