// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "container/base/result.hpp"
#include "container/records.hpp"

/// Payloads of records <-> structures; FORMAT.md, section 4, has the field tables.
///
/// serialize() writes the payload without the record header. The record must pass validate(): what
/// is written of one that does not is unspecified.
///
/// parse_x() reads a whole payload; parse_x(serialize(r)) == r for a valid r, and
/// serialize(*parse_x(b))
/// == b whenever parsing succeeds: a record has one encoding. Errors: kTruncated when the payload
/// ends inside a field, kCorrupt, kLimit, kUnsupported for enumerators that a later version may
/// have added. Allocates at most a small multiple of the payload's size.
///
/// validate() checks what can be checked inside one record: limits, finite floats, ranges,
/// duplicates, rectangles inside pictures. parse_x() ends with it. Errors: as parse_x(); the
/// message names the field.
namespace relit::container {

[[nodiscard]] std::vector<std::uint8_t> serialize(const HeaderRecord& record);
[[nodiscard]] std::vector<std::uint8_t> serialize(const ClipRecord& record);
[[nodiscard]] std::vector<std::uint8_t> serialize(const ImageRecord& record);
[[nodiscard]] std::vector<std::uint8_t> serialize(const MaterialRecord& record);
[[nodiscard]] std::vector<std::uint8_t> serialize(const MeshRecord& record);
[[nodiscard]] std::vector<std::uint8_t> serialize(const SkeletonRecord& record);
[[nodiscard]] std::vector<std::uint8_t> serialize(const PoseTrackRecord& record);
[[nodiscard]] std::vector<std::uint8_t> serialize(const ModelRecord& record);
[[nodiscard]] std::vector<std::uint8_t> serialize(const LayerRecord& record);
[[nodiscard]] std::vector<std::uint8_t> serialize(const SegmentRecord& record);
[[nodiscard]] std::vector<std::uint8_t> serialize(const ChunkRecord& record);
[[nodiscard]] std::vector<std::uint8_t> serialize(const IndexRecord& record);
[[nodiscard]] std::vector<std::uint8_t> serialize(const EndRecord& record);

/// Also kUnsupported for a major version above kVersionMajor, before anything else is read.
[[nodiscard]] Result<HeaderRecord> parse_header(std::span<const std::uint8_t> payload);
[[nodiscard]] Result<ClipRecord> parse_clip(std::span<const std::uint8_t> payload);
[[nodiscard]] Result<ImageRecord> parse_image(std::span<const std::uint8_t> payload);
[[nodiscard]] Result<MaterialRecord> parse_material(std::span<const std::uint8_t> payload);
[[nodiscard]] Result<MeshRecord> parse_mesh(std::span<const std::uint8_t> payload);
[[nodiscard]] Result<SkeletonRecord> parse_skeleton(std::span<const std::uint8_t> payload);
[[nodiscard]] Result<PoseTrackRecord> parse_pose_track(std::span<const std::uint8_t> payload);
[[nodiscard]] Result<ModelRecord> parse_model(std::span<const std::uint8_t> payload);
[[nodiscard]] Result<LayerRecord> parse_layer(std::span<const std::uint8_t> payload);
[[nodiscard]] Result<SegmentRecord> parse_segment(std::span<const std::uint8_t> payload);
[[nodiscard]] Result<ChunkRecord> parse_chunk(std::span<const std::uint8_t> payload);
/// The same into records whose storage is reused; what they hold after an error is undefined.
[[nodiscard]] Status parse_segment_into(std::span<const std::uint8_t> payload,
                                        SegmentRecord& record);
[[nodiscard]] Status parse_chunk_into(std::span<const std::uint8_t> payload, ChunkRecord& record);
[[nodiscard]] Result<IndexRecord> parse_index(std::span<const std::uint8_t> payload);
[[nodiscard]] Result<EndRecord> parse_end(std::span<const std::uint8_t> payload);

[[nodiscard]] Status validate(const HeaderRecord& record);
[[nodiscard]] Status validate(const ClipRecord& record);
[[nodiscard]] Status validate(const ImageRecord& record);
[[nodiscard]] Status validate(const MaterialRecord& record);
[[nodiscard]] Status validate(const MeshRecord& record);
[[nodiscard]] Status validate(const SkeletonRecord& record);
[[nodiscard]] Status validate(const PoseTrackRecord& record);
[[nodiscard]] Status validate(const ModelRecord& record);
[[nodiscard]] Status validate(const LayerRecord& record);
[[nodiscard]] Status validate(const SegmentRecord& record);
[[nodiscard]] Status validate(const ChunkRecord& record);
[[nodiscard]] Status validate(const IndexRecord& record);
[[nodiscard]] Status validate(const EndRecord& record);

}  // namespace relit::container
