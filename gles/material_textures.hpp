// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "gles/device.hpp"
#include "gles/image.hpp"

namespace relit::gles {

enum class Wrap { kRepeat, kClamp, kMirror };
enum class AlphaMode { kOpaque, kMask, kBlend };

/// Albedo = decode_srgb(image) × base_color × vertex colour.
struct MaterialView {
  std::array<float, 4> base_color{1, 1, 1, 1};  ///< linear, straight alpha
  int image = -1;                               ///< into the images given with it; -1: none
  Wrap wrap_u = Wrap::kRepeat;
  Wrap wrap_v = Wrap::kRepeat;
  bool linear_filter = true;  ///< with mipmaps; false: the nearest texel
  AlphaMode alpha_mode = AlphaMode::kOpaque;
  float alpha_cutoff = 0.5f;  ///< kMask: fragments with less alpha are left out
};

/// A material on the GPU.
struct MaterialTexture {
  MaterialView material;
  int texture = -1;             ///< into MaterialTextures::textures; -1: none
  bool wrap_in_shader = false;  ///< the texture clamps; the shader repeats or mirrors
};

/// The image of a number, valid until the next call; none: it cannot be had, and what shows it is
/// drawn without. So one image at a time need be in memory.
using ImageLoader = std::function<std::optional<ImageView>(std::size_t index)>;

/// Uploads the images of materials, once for every way in which they are sampled. Images beyond the
/// maximal texture size are reduced. Where sizes that are no powers of two can neither repeat nor
/// have mipmaps (ES 2), filtered images are enlarged to the next powers of two, and unfiltered ones
/// keep their size and are wrapped by the shader: both look as on ES 3.
class MaterialTextures {
 public:
  /// Of `image_count` images, those that materials show are loaded, once each and in order. Errors:
  /// kInvalid for an image or an index that makes no sense, kOutOfMemory, kEnvironment.
  static Result<MaterialTextures> create(const Device& device, std::size_t image_count,
                                         const ImageLoader& load,
                                         std::span<const MaterialView> materials);

  [[nodiscard]] const std::vector<MaterialTexture>& materials() const { return materials_; }
  [[nodiscard]] GLuint texture(int index) const {
    return textures_[static_cast<std::size_t>(index)].name();
  }
  /// What the textures take, mipmaps included.
  [[nodiscard]] std::size_t gpu_bytes() const { return gpu_bytes_; }

 private:
  Status show(const Device& device, const ImageView& image, int index);
  Texture upload(const Device& device, const ImageView& image, const MaterialView& material,
                 bool& wrap_in_shader);

  std::vector<MaterialTexture> materials_;
  std::vector<Texture> textures_;
  std::size_t gpu_bytes_ = 0;
};

}  // namespace relit::gles
