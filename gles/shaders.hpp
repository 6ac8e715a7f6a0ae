// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

/// The texts of gles/shaders/*.glsl, which the build embeds; `name.stage.glsl` becomes
/// `name_stage`.
namespace relit::gles::shaders {

extern const std::string_view background_frag;
extern const std::string_view background_vert;
extern const std::string_view character_frag;
extern const std::string_view character_vert;
extern const std::string_view color;
extern const std::string_view composite_fused;
extern const std::string_view composite_group;
extern const std::string_view composite_head;
extern const std::string_view composite_lookup_vert;
extern const std::string_view composite_predict;
extern const std::string_view composite_tail;
extern const std::string_view composite_taps;
extern const std::string_view composite_unrolled;
extern const std::string_view composite_vert;
extern const std::string_view dither;
extern const std::string_view gradient_frag;
extern const std::string_view mix_frag;
extern const std::string_view mix_vert;
extern const std::string_view overlay_frag;
extern const std::string_view overlay_vert;
extern const std::string_view prelude;
extern const std::string_view present_frag;
extern const std::string_view present_vert;

}  // namespace relit::gles::shaders
