// SPDX-License-Identifier: MIT
#include "bake_minimal/material_packer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "bake_minimal/texture_math.hpp"
#include "decoders/png_encoder.hpp"

namespace relit::bake {
namespace {

/// The blue channel in [0,1] at texture coordinate (u, v), bilinear.
double blue_at(const Image& image, const TextureUse& use, double u, double v) {
  const double x = u * image.width - 0.5, y = v * image.height - 0.5;
  const double fx = x - std::floor(x), fy = y - std::floor(y);
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  double sum = 0;
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      const int tx = wrapped(x0 + i, image.width, use.wrap_u);
      const int ty = wrapped(y0 + j, image.height, use.wrap_v);
      const double weight = (i != 0 ? fx : 1 - fx) * (j != 0 ? fy : 1 - fy);
      sum += weight *
             image.rgba[(static_cast<std::size_t>(ty) * static_cast<std::size_t>(image.width) +
                         static_cast<std::size_t>(tx)) *
                            4 +
                        2];
    }
  }
  return sum / 255;
}

struct BlueStatistics {
  double mean = 0;
  bool constant = true;
};

BlueStatistics blue_statistics(const Image& image) {
  std::uint64_t sum = 0;
  BlueStatistics out;
  for (std::size_t i = 2; i < image.rgba.size(); i += 4) {
    sum += image.rgba[i];
    out.constant = out.constant && image.rgba[i] == image.rgba[2];
  }
  out.mean = static_cast<double>(sum) / (255.0 * static_cast<double>(image.rgba.size() / 4));
  return out;
}

bool same_coordinates(const TextureUse& a, const TextureUse& b) {
  return a.texcoord == b.texcoord && a.uv_transform == b.uv_transform && a.wrap_u == b.wrap_u &&
         a.wrap_v == b.wrap_v;
}

class MaterialPacker {
 public:
  explicit MaterialPacker(const Scene& scene) : scene_(scene) {
    out_.packed_index.assign(scene.materials.size(), -1);
  }

  Result<PackedMaterials> run(std::span<const int> used) {
    for (const int index : used) {
      if (index < 0 || static_cast<std::size_t>(index) >= scene_.materials.size()) {
        return fail(ErrorCode::kInvalid, "material " + std::to_string(index) + " does not exist");
      }
      if (out_.packed_index[static_cast<std::size_t>(index)] >= 0) continue;
      RELIT_TRY(pack(static_cast<std::size_t>(index)));
    }
    return std::move(out_);
  }

 private:
  Status pack(std::size_t index) {
    const Material& material = scene_.materials[index];
    container::MaterialRecord record;
    record.id = static_cast<std::uint32_t>(out_.materials.size());
    record.name = material.name;
    record.alpha_mode = material.alpha_mode;
    record.alpha_cutoff = material.alpha_cutoff;
    RELIT_TRY(check_texture(material.base_color_texture, material));
    RELIT_TRY(check_texture(material.metallic_texture, material));

    double factor = 1;  // of the linear base colour
    RELIT_ASSIGN(TextureUse use, fold_metallic(material, factor));
    for (int c = 0; c < 4; ++c) {
      const double v = material.base_color[c] * (c < 3 ? factor : 1.0);
      record.base_color[static_cast<std::size_t>(c)] = static_cast<float>(v);
    }
    record.image_id = use.image;
    record.wrap_u = use.wrap_u;
    record.wrap_v = use.wrap_v;
    record.linear_filter = use.linear_filter;
    out_.packed_index[index] = static_cast<int>(record.id);
    out_.materials.push_back(std::move(record));
    out_.texture.push_back(use);
    return {};
  }

  Status check_texture(const TextureUse& use, const Material& material) const {
    if (use.image < 0) return {};
    const auto image = static_cast<std::size_t>(use.image);
    if (image >= scene_.images.size()) {
      return fail(ErrorCode::kInvalid, "material \"" + material.name + "\": image " +
                                           std::to_string(use.image) + " does not exist");
    }
    const Image& i = scene_.images[image];
    if (i.width <= 0 || i.height <= 0 ||
        i.rgba.size() !=
            4 * static_cast<std::size_t>(i.width) * static_cast<std::size_t>(i.height)) {
      return fail(ErrorCode::kInvalid, "image \"" + i.name + "\" has no texels");
    }
    return {};
  }

  /// Decides between texture and factor; returns the texture to use, its image numbered as packed.
  Result<TextureUse> fold_metallic(const Material& material, double& factor) {
    const TextureUse& base = material.base_color_texture;
    const TextureUse& metal = material.metallic_texture;
    const double metallic = std::clamp(static_cast<double>(material.metallic), 0.0, 1.0);
    if (metal.image < 0 || metallic == 0) {
      factor = 1 - metallic;
      return pass_through(base);
    }
    const BlueStatistics blue =
        blue_statistics(scene_.images[static_cast<std::size_t>(metal.image)]);
    if (blue.constant) {
      factor = 1 - metallic * blue.mean;
      return pass_through(base);
    }
    if (base.image < 0 || same_coordinates(base, metal)) return multiply(base, metal, metallic);
    factor = 1 - metallic * blue.mean;
    out_.warnings.push_back("material \"" + material.name +
                            "\": base colour and metallic texture differ in UV set, transform or "
                            "wrapping; the mean metallic value was taken");
    return pass_through(base);
  }

  Result<TextureUse> pass_through(const TextureUse& base) {
    TextureUse use = base;
    if (base.image < 0) return use;
    const auto key = std::make_tuple(base.image, -1, 0.0);
    if (const auto found = stored_.find(key); found != stored_.end()) {
      use.image = found->second;
      return use;
    }
    use.image = store(key, scene_.images[static_cast<std::size_t>(base.image)]);
    return use;
  }

  /// The base colour image (white without one) times (1 − metallic), as a PNG.
  Result<TextureUse> multiply(const TextureUse& base, const TextureUse& metal, double metallic) {
    TextureUse use = base.image < 0 ? metal : base;
    const auto key = std::make_tuple(base.image, metal.image, metallic);
    if (const auto found = stored_.find(key); found != stored_.end()) {
      use.image = found->second;
      return use;
    }
    const Image& mask = scene_.images[static_cast<std::size_t>(metal.image)];
    Image image = base.image < 0 ? mask : scene_.images[static_cast<std::size_t>(base.image)];
    if (base.image < 0) std::fill(image.rgba.begin(), image.rgba.end(), std::uint8_t{255});
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        const double keep =
            1 - metallic * blue_at(mask, metal, (x + 0.5) / image.width, (y + 0.5) / image.height);
        std::uint8_t* p =
            &image.rgba[4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                             static_cast<std::size_t>(x))];
        for (int c = 0; c < 3; ++c) {
          const double linear = srgb_to_linear(p[c] / 255.0) * keep;
          p[c] = static_cast<std::uint8_t>(
              std::lround(255 * std::clamp(linear_to_srgb(linear), 0.0, 1.0)));
        }
      }
    }
    RELIT_ASSIGN(image.encoded, decoders::encode_png(image.width, image.height, image.rgba));
    image.media_type = "image/png";
    use.image = store(key, std::move(image));
    return use;
  }

  using ImageKey = std::tuple<int, int, double>;  // base, metallic, factor

  int store(const ImageKey& key, Image image) {
    const auto id = static_cast<std::uint32_t>(out_.images.size());
    // Two images of the glTF may hold the same bytes.
    for (const container::ImageRecord& other : out_.images) {
      if (other.bytes == image.encoded) return stored_[key] = static_cast<int>(other.id);
    }
    out_.images.push_back({id, image.media_type, image.encoded});
    out_.texels.push_back(std::move(image));
    return stored_[key] = static_cast<int>(id);
  }

  const Scene& scene_;
  PackedMaterials out_;
  std::map<ImageKey, int> stored_;
};

}  // namespace

Result<PackedMaterials> pack_materials(const Scene& scene, std::span<const int> used) {
  return MaterialPacker(scene).run(used);
}

}  // namespace relit::bake
