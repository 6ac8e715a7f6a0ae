// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "container/base/result.hpp"
#include "decoders/sh.hpp"
#include "player/light_field.hpp"

/// The formats behind load_light(), from the bytes of whole files. Messages do not name the file;
/// the caller does.
namespace relit::player {

[[nodiscard]] bool is_hdr(std::span<const std::uint8_t> bytes);
[[nodiscard]] bool is_exr(std::span<const std::uint8_t> bytes);

/// Pixels are as in the file, possibly negative or not finite in an .exr.
Result<decoders::Environment> read_hdr(std::span<const std::uint8_t> bytes);
Result<decoders::Environment> read_exr(std::span<const std::uint8_t> bytes,
                                       std::vector<std::string>& warnings);
/// A .json, of one light, of keys over time, of probes in space, or of both.
Result<LightField> read_light_field(std::span<const std::uint8_t> bytes);

/// kLimit where a picture of this size must not be allocated.
Status check_picture_size(std::int64_t width, std::int64_t height);

}  // namespace relit::player
