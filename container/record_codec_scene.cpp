// SPDX-License-Identifier: MIT
// HEAD, CLIP, IMAG, MATL.
#include <algorithm>

#include "container/base/bytes.hpp"
#include "container/framing.hpp"
#include "container/record_checks.hpp"
#include "container/record_codec.hpp"

namespace relit::container {

using namespace checks;

std::vector<std::uint8_t> serialize(const HeaderRecord& record) {
  ByteWriter w;
  w.u16(record.version_major);
  w.u16(record.version_minor);
  w.u32(0);
  w.string(record.writer);
  return w.take();
}

Result<HeaderRecord> parse_header(std::span<const std::uint8_t> payload) {
  ByteReader r(payload);
  HeaderRecord record;
  record.version_major = r.u16("version_major");
  record.version_minor = r.u16("version_minor");
  if (r.ok() && record.version_major > kVersionMajor)
    return fail(ErrorCode::kUnsupported,
                "the file has format version " + std::to_string(record.version_major) + "." +
                    std::to_string(record.version_minor) + ", this reader knows versions up to " +
                    std::to_string(kVersionMajor) + ".x: a newer relit is needed");
  if (r.ok() && record.version_major == 0 && record.version_minor < kVersionMinor)
    return fail(ErrorCode::kUnsupported,
                "the file has format version 0." + std::to_string(record.version_minor) +
                    ", a draft that this reader no longer knows: write it again");
  r.zero_u32("reserved");
  record.writer = r.string("writer", limits::kStringBytes);
  RELIT_TRY(r.finish());
  RELIT_TRY(validate(record));
  return record;
}

Status validate(const HeaderRecord& record) { return text(record.writer, "writer"); }

std::vector<std::uint8_t> serialize(const ClipRecord& record) {
  ByteWriter w;
  w.u32(record.id);
  w.string(record.name);
  w.u32(static_cast<std::uint32_t>(record.tick_rate.num));
  w.u32(static_cast<std::uint32_t>(record.tick_rate.den));
  w.u64(record.frame_count);
  w.u64(record.duration_ticks);
  w.boolean(record.loop);
  w.f32s(record.bounds_min);
  w.f32s(record.bounds_max);
  return w.take();
}

Result<ClipRecord> parse_clip(std::span<const std::uint8_t> payload) {
  ByteReader r(payload);
  ClipRecord record;
  record.id = r.u32("id");
  record.name = r.string("name", limits::kStringBytes);
  record.tick_rate.num = r.u32("tick_rate.num");
  record.tick_rate.den = r.u32("tick_rate.den");
  record.frame_count = r.u64("frame_count");
  record.duration_ticks = r.u64("duration_ticks");
  record.loop = r.boolean("loop");
  record.bounds_min = r.f32s<3>("bounds_min");
  record.bounds_max = r.f32s<3>("bounds_max");
  RELIT_TRY(r.finish());
  RELIT_TRY(validate(record));
  return record;
}

Status validate(const ClipRecord& record) {
  RELIT_TRY(text(record.name, "name"));
  const auto& rate = record.tick_rate;
  RELIT_REQUIRE(rate.num > 0 && rate.den > 0 && rate.num <= limits::kRational &&
                    rate.den <= limits::kRational,
                "tick_rate " + std::to_string(rate.num) + "/" + std::to_string(rate.den) +
                    " is not a fraction of two integers in 1..2147483647");
  RELIT_TRY(one_to(record.frame_count, limits::kFrames, "frame_count"));
  RELIT_TRY(one_to(record.duration_ticks, limits::kTicks, "duration_ticks"));
  RELIT_REQUIRE(record.duration_ticks >= record.frame_count,
                "duration_ticks " + std::to_string(record.duration_ticks) +
                    " is less than one tick for each of " + std::to_string(record.frame_count) +
                    " frames");
  RELIT_TRY(finite(record.bounds_min, "bounds_min"));
  RELIT_TRY(finite(record.bounds_max, "bounds_max"));
  for (std::size_t i = 0; i < 3; ++i)
    RELIT_REQUIRE(record.bounds_min[i] <= record.bounds_max[i], "bounds_min lies above bounds_max");
  return {};
}

std::vector<std::uint8_t> serialize(const ImageRecord& record) {
  ByteWriter w;
  w.reserve(record.bytes.size() + record.media_type.size() + 10);
  w.u32(record.id);
  w.string(record.media_type);
  w.bytes(record.bytes);
  return w.take();
}

Result<ImageRecord> parse_image(std::span<const std::uint8_t> payload) {
  ByteReader r(payload);
  ImageRecord record;
  record.id = r.u32("id");
  record.media_type = r.string("media_type", limits::kStringBytes);
  record.bytes = r.bytes("bytes", limits::kRecordBytes);
  RELIT_TRY(r.finish());
  RELIT_TRY(validate(record));
  return record;
}

Status validate(const ImageRecord& record) {
  RELIT_TRY(text(record.media_type, "media_type"));
  if (record.media_type != "image/png" && record.media_type != "image/jpeg")
    return fail(ErrorCode::kUnsupported, "media_type '" + record.media_type +
                                             "' is unknown: image/png and image/jpeg are known");
  RELIT_REQUIRE(!record.bytes.empty(), "the image has no bytes");
  return {};
}

std::vector<std::uint8_t> serialize(const MaterialRecord& record) {
  ByteWriter w;
  w.u32(record.id);
  w.string(record.name);
  w.f32s(record.base_color);
  w.i32(record.image_id);
  w.u8(static_cast<std::uint8_t>(record.wrap_u));
  w.u8(static_cast<std::uint8_t>(record.wrap_v));
  w.boolean(record.linear_filter);
  w.u8(static_cast<std::uint8_t>(record.alpha_mode));
  w.f32(record.alpha_cutoff);
  return w.take();
}

Result<MaterialRecord> parse_material(std::span<const std::uint8_t> payload) {
  ByteReader r(payload);
  MaterialRecord record;
  record.id = r.u32("id");
  record.name = r.string("name", limits::kStringBytes);
  record.base_color = r.f32s<4>("base_color");
  record.image_id = r.i32("image_id");
  record.wrap_u = r.enumeration("wrap_u", Wrap::kMirror);
  record.wrap_v = r.enumeration("wrap_v", Wrap::kMirror);
  record.linear_filter = r.boolean("linear_filter");
  record.alpha_mode = r.enumeration("alpha_mode", AlphaMode::kBlend);
  record.alpha_cutoff = r.f32("alpha_cutoff");
  RELIT_TRY(r.finish());
  RELIT_TRY(validate(record));
  return record;
}

Status validate(const MaterialRecord& record) {
  RELIT_TRY(text(record.name, "name"));
  RELIT_TRY(not_negative(record.base_color, "base_color"));
  RELIT_REQUIRE(std::ranges::all_of(record.base_color, [](float v) { return v <= 1; }),
                "base_color exceeds 1");
  RELIT_REQUIRE(record.image_id >= -1, "image_id is below -1");
  RELIT_TRY(known(record.wrap_u, Wrap::kMirror, "wrap_u"));
  RELIT_TRY(known(record.wrap_v, Wrap::kMirror, "wrap_v"));
  RELIT_TRY(known(record.alpha_mode, AlphaMode::kBlend, "alpha_mode"));
  return not_negative(std::array{record.alpha_cutoff}, "alpha_cutoff");
}

}  // namespace relit::container
