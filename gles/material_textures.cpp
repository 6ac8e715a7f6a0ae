// SPDX-License-Identifier: MIT
#include "gles/material_textures.hpp"

#include <algorithm>
#include <cmath>

#include "container/base/limits.hpp"

namespace relit::gles {
namespace {

GLint wrap_mode(Wrap wrap) {
  if (wrap == Wrap::kClamp) return GL_CLAMP_TO_EDGE;
  return wrap == Wrap::kMirror ? GL_MIRRORED_REPEAT : GL_REPEAT;
}

bool samples_alike(const MaterialView& a, const MaterialView& b) {
  return a.image == b.image && a.wrap_u == b.wrap_u && a.wrap_v == b.wrap_v &&
         a.linear_filter == b.linear_filter;
}

Status check_image(const ImageView& image, std::size_t index) {
  const int limit = static_cast<int>(limits::kImageSide);
  if (image.width < 1 || image.height < 1 || image.width > limit || image.height > limit ||
      image.rgba.size() !=
          4 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height))
    return fail(ErrorCode::kInvalid,
                "image " + std::to_string(index) + ": " + std::to_string(image.width) + "x" +
                    std::to_string(image.height) + " with " + std::to_string(image.rgba.size()) +
                    " bytes; four bytes a texel and 1 to " + std::to_string(limit) +
                    " texels a side were expected");
  return {};
}

Status check_material(const MaterialView& material, std::size_t index, std::size_t images) {
  bool finite = std::isfinite(material.alpha_cutoff);
  for (const float c : material.base_color) finite = finite && std::isfinite(c);
  if (!finite || material.image < -1 || material.image >= static_cast<int>(images))
    return fail(ErrorCode::kInvalid, "material " + std::to_string(index) +
                                         ": its colour is not finite or its image does not exist");
  return {};
}

}  // namespace

Result<MaterialTextures> MaterialTextures::create(const Device& device, std::size_t image_count,
                                                  const ImageLoader& load,
                                                  std::span<const MaterialView> materials) {
  RELIT_TRY(device.ready("uploading the materials' images"));
  MaterialTextures result;
  StateGuard guard(device);
  for (std::size_t i = 0; i < materials.size(); ++i) {
    RELIT_TRY(check_material(materials[i], i, image_count));
    result.materials_.push_back({materials[i]});
  }
  for (std::size_t i = 0; i < image_count; ++i) {
    const auto shows = [&](const MaterialView& m) { return m.image == static_cast<int>(i); };
    if (std::none_of(materials.begin(), materials.end(), shows)) continue;
    const std::optional<ImageView> image = load(i);
    if (!image) continue;
    RELIT_TRY(check_image(*image, i));
    RELIT_TRY(result.show(device, *image, static_cast<int>(i)));
  }
  return result;
}

Status MaterialTextures::show(const Device& device, const ImageView& image, int index) {
  for (auto entry = materials_.begin(); entry != materials_.end(); ++entry) {
    if (entry->material.image != index) continue;
    const auto twin = std::find_if(materials_.begin(), entry, [&](const MaterialTexture& other) {
      return samples_alike(other.material, entry->material);
    });
    if (twin != entry) {
      entry->texture = twin->texture;
      entry->wrap_in_shader = twin->wrap_in_shader;
      continue;
    }
    entry->texture = static_cast<int>(textures_.size());
    textures_.push_back(upload(device, image, entry->material, entry->wrap_in_shader));
  }
  return device.check("uploading the materials' images");
}

Texture MaterialTextures::upload(const Device& device, const ImageView& image,
                                 const MaterialView& material, bool& wrap_in_shader) {
  const Capabilities& caps = device.caps();
  int width = std::min(image.width, caps.max_texture_size);
  int height = std::min(image.height, caps.max_texture_size);
  const bool odd = power_of_two_above(width) != width || power_of_two_above(height) != height;
  const bool clamps = material.wrap_u == Wrap::kClamp && material.wrap_v == Wrap::kClamp;
  if (odd && !caps.npot_repeat) {
    if (material.linear_filter) {
      width = std::min(power_of_two_above(width), caps.max_texture_size);
      height = std::min(power_of_two_above(height), caps.max_texture_size);
    } else {
      wrap_in_shader = !clamps;
    }
  }
  std::vector<std::uint8_t> resampled;
  const std::uint8_t* texels = image.rgba.data();
  if (width != image.width || height != image.height) {
    resampled =
        resample(image, {width, height, material.linear_filter, material.wrap_u == Wrap::kRepeat,
                         material.wrap_v == Wrap::kRepeat});
    texels = resampled.data();
  }
  const Functions& gl = device.gl();
  TextureFormat format;
  if (device.is_es3()) format.internal_format = GL_SRGB8_ALPHA8;
  format.filter = material.linear_filter ? GL_LINEAR : GL_NEAREST;
  Texture texture = make_texture(device, format, width, height, texels);
  if (!wrap_in_shader) {
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, wrap_mode(material.wrap_u));
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, wrap_mode(material.wrap_v));
  }
  std::size_t bytes = 4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (material.linear_filter) {
    gl.GenerateMipmap(GL_TEXTURE_2D);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    if (caps.max_anisotropy > 1)
      gl.TexParameterf(GL_TEXTURE_2D, GL_TEXTURE_MAX_ANISOTROPY_EXT,
                       std::min(4.0f, caps.max_anisotropy));
    bytes += bytes / 3;
  }
  gpu_bytes_ += bytes;
  gl.BindTexture(GL_TEXTURE_2D, 0);
  return texture;
}

}  // namespace relit::gles
