// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <span>
#include <vector>

#include "container/base/plane_view.hpp"
#include "gles/device.hpp"
#include "gles/plane_set.hpp"

namespace relit::gles {

/// The textures that planes are uploaded to: rectangles of decoded pictures packed into a few
/// sheets of at most 2048² texels, one byte a texel (8-bit mantissas, exponents) or two (10-bit
/// mantissas and the 16 bits of normals, low and high byte as they lie in memory). Sampled with
/// nearest filtering.
///
/// There are two slots of everything where planes change every frame, else one. A slot holds a
/// frame, so that two can be blended, and an upload waits for no draw of the one before.
class PlaneSheets {
 public:
  /// One plane's mantissas or exponents in a sheet.
  struct Place {
    int sheet = -1;  ///< -1: none
    int tile = -1;   ///< the same for planes that share their exponents
    int shift = 0;
    int x = 0, y = 0;  ///< of the first sample, texels of the sheet
  };
  /// A plane's numbers in the frame that a slot holds.
  struct PlaneState {
    bool present = false;
    double factor = 0;  ///< value = factor × normalised mantissa × 2^(E − exponent_reference)
    int exponent_reference = 0;  ///< the frame's largest E of the plane; 0 if it has no exponents
  };

  /// Errors: kInvalid for a description that contradicts itself, kLimit when a plane is larger than
  /// a texture may be.
  static Result<PlaneSheets> create(const Device& device, const PlaneSetDescription& description);

  /// What create() would take, for the memory plan: gpu_bytes() and cpu_bytes() of sheets on a
  /// device whose textures may have `max_texture_size` texels a side. Errors: as create().
  struct Bytes {
    std::size_t gpu = 0;
    std::size_t cpu = 0;
  };
  static Result<Bytes> measure(const PlaneSetDescription& description, int max_texture_size);

  /// Uploads the planes whose mantissa view is not empty and whose entry in `wanted` is not 0
  /// (empty: all are wanted); see Compositor::upload(). What the slot held is forgotten unless
  /// `keep`, by which planes of the same frame are added to it. Errors: kInvalid.
  Status upload(std::span<const PlaneView> planes, int slot = 0,
                std::span<const std::uint8_t> wanted = {}, bool keep = false);

  [[nodiscard]] const Place& mantissa(std::size_t plane) const { return mantissas_[plane]; }
  [[nodiscard]] const Place& exponent(std::size_t plane) const { return exponents_[plane]; }
  [[nodiscard]] const PlaneState& state(std::size_t plane, int slot) const {
    return states_[static_cast<std::size_t>(slot)][plane];
  }
  [[nodiscard]] int slot_count() const { return slot_count_; }
  [[nodiscard]] unsigned channels(std::size_t plane) const { return planes_[plane].channels; }
  [[nodiscard]] std::size_t plane_count() const { return planes_.size(); }
  /// As described.
  [[nodiscard]] int prediction_plane() const { return prediction_plane_; }
  [[nodiscard]] bool is_normal(std::size_t plane) const;
  /// Whether a slot has everything that s · E(N) takes, s and the three planes of the normals.
  [[nodiscard]] bool can_predict(int slot) const;
  [[nodiscard]] int sheet_count() const { return static_cast<int>(sheets_.size()); }
  /// (offset.xy, scale.xy) such that offset + scale × texel is the place's texture coordinate for
  /// the light map's texel (x+½, y+½).
  [[nodiscard]] std::array<float, 4> coordinates(const Place& place) const;
  /// The texture of a sheet that holds a slot's frame.
  [[nodiscard]] GLuint texture(int sheet, int slot) const;
  /// What the textures and the staging memory take.
  [[nodiscard]] std::size_t gpu_bytes() const;
  [[nodiscard]] std::size_t cpu_bytes() const { return staging_.size(); }

 private:
  // A rectangle of samples with the planes that use it.
  struct Tile {
    bool exponent = false;
    int shift = 0;
    int width = 0, height = 0;
    int x = 0, y = 0;  // in the region
    int region = -1;
    std::vector<std::uint32_t> planes;
  };
  // What is uploaded in one call: the box of a picture component that holds its tiles, or one tile.
  struct Region {
    bool wide = false;
    int width = 0, height = 0;
    int sheet = -1, x = 0, y = 0;
    std::vector<std::uint32_t> tiles;
  };
  struct Sheet {
    bool wide = false;
    int width = 0, height = 0;
    std::array<Texture, 2> textures;
  };

  Status lay_out(const PlaneSetDescription& description, int max_texture_size);
  [[nodiscard]] std::size_t largest_region_bytes() const;
  Status describe(const PlaneSetDescription& description);
  Status describe_prediction(const PlaneSetDescription& description);
  void add_tile(const PlaneSetDescription& description, std::size_t plane, bool exponent);
  void make_regions(const PlaneSetDescription& description, int limit);
  Status pack(int limit);
  void make_textures();

  Status check_view(std::size_t plane, const PlaneView& view) const;
  const SampleView* find_view(const Tile& tile, std::span<const PlaneView> planes) const;
  void upload_region(const Region& region, std::span<const PlaneView> planes, int slot);
  void upload_rectangle(const Region& region, int x, int y, const SampleView& samples,
                        int slot) const;
  void note_state(std::size_t plane, const PlaneView& view, PlaneState& state);

  const Device* device_ = nullptr;
  int slot_count_ = 1;
  std::vector<PlaneDescription> planes_;
  int prediction_plane_ = -1, normal_planes_ = -1;
  int width_ = 0, height_ = 0;
  std::vector<Tile> tiles_;
  std::vector<Region> regions_;
  std::vector<Sheet> sheets_;
  std::vector<Place> mantissas_;
  std::vector<Place> exponents_;
  std::array<std::vector<PlaneState>, 2> states_;  // by slot
  std::vector<int> tile_exponents_;  // the largest E of a tile in this frame; -1: not looked at yet
  std::vector<std::uint8_t> active_;  // planes that this upload is for
  mutable std::vector<std::uint8_t> staging_;
};

}  // namespace relit::gles
