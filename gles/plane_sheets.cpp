// SPDX-License-Identifier: MIT
#include "gles/plane_sheets.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "container/base/limits.hpp"

namespace relit::gles {
namespace {

// The largest texture of the smallest machine; sheets do not grow beyond it elsewhere either,
// because upload cost and cache behaviour gain nothing from it.
constexpr int kSheetSide = 2048;
constexpr std::size_t kNormalPlanes = 3;

int shifted(int size, int shift) { return (size + (1 << shift) - 1) >> shift; }

std::string plane_name(std::size_t plane) { return "plane " + std::to_string(plane); }

}  // namespace

Result<PlaneSheets> PlaneSheets::create(const Device& device,
                                        const PlaneSetDescription& description) {
  PlaneSheets sheets;
  sheets.device_ = &device;
  RELIT_TRY(sheets.lay_out(description, device.caps().max_texture_size));
  sheets.make_textures();
  return sheets;
}

Result<PlaneSheets::Bytes> PlaneSheets::measure(const PlaneSetDescription& description,
                                                int max_texture_size) {
  PlaneSheets sheets;
  RELIT_TRY(sheets.lay_out(description, max_texture_size));
  return Bytes{sheets.gpu_bytes(), sheets.largest_region_bytes()};
}

Status PlaneSheets::lay_out(const PlaneSetDescription& description, int max_texture_size) {
  slot_count_ = description.changes_every_frame ? 2 : 1;
  RELIT_TRY(describe(description));
  const int limit = std::min(kSheetSide, max_texture_size);
  make_regions(description, limit);
  return pack(limit);
}

Status PlaneSheets::describe(const PlaneSetDescription& d) {
  const auto side = static_cast<int>(limits::kLightMapSide);
  if (d.width < 1 || d.height < 1 || d.width > side || d.height > side)
    return fail(ErrorCode::kInvalid, "a light map of " + std::to_string(d.width) + "x" +
                                         std::to_string(d.height) + " texels; 1 to " +
                                         std::to_string(side) + " a side are possible");
  const std::size_t most = limits::kPlanes + (d.normal_planes >= 0 ? kNormalPlanes : 0);
  if (d.planes.size() > most)
    return fail(ErrorCode::kLimit, std::to_string(d.planes.size()) + " planes; at most " +
                                       std::to_string(most) + " are possible");
  width_ = d.width;
  height_ = d.height;
  planes_ = d.planes;
  mantissas_.resize(planes_.size());
  exponents_.resize(planes_.size());
  for (std::vector<PlaneState>& states : states_) states.resize(planes_.size());
  active_.resize(planes_.size());
  RELIT_TRY(describe_prediction(d));
  for (std::size_t k = 0; k < planes_.size(); ++k) {
    const PlaneDescription& plane = planes_[k];
    const bool depth = is_normal(k) || plane.bit_depth == 8 || plane.bit_depth == 10;
    if (!depth || plane.mantissa_shift < 0 || plane.mantissa_shift > 1 ||
        plane.exponent_shift < 0 || plane.exponent_shift > 5)
      return fail(ErrorCode::kInvalid,
                  plane_name(k) +
                      ": bit depth must be 8 or 10, the mantissa's shift 0 or 1, the "
                      "exponent's 0 to 5");
    // Offsets are subtracted from pointers, so they must stay far from overflow.
    const auto far = static_cast<int>(limits::kVideoSide);
    for (const PicturePlace& at : {plane.mantissa, plane.exponent})
      if (at.x < 0 || at.y < 0 || at.x > far || at.y > far)
        return fail(
            ErrorCode::kInvalid,
            plane_name(k) + ": its place in the picture is outside 0 to " + std::to_string(far));
    add_tile(d, k, false);
    if (plane.has_exponent) add_tile(d, k, true);
  }
  tile_exponents_.resize(tiles_.size());
  return {};
}

Status PlaneSheets::describe_prediction(const PlaneSetDescription& d) {
  prediction_plane_ = d.prediction_plane;
  normal_planes_ = d.normal_planes;
  const auto count = static_cast<int>(d.planes.size());
  const bool none = prediction_plane_ == -1 && normal_planes_ == -1;
  const bool both = prediction_plane_ >= 0 && prediction_plane_ < count && normal_planes_ >= 0 &&
                    normal_planes_ <= count - static_cast<int>(kNormalPlanes);
  if (!none && (!both || is_normal(static_cast<std::size_t>(prediction_plane_))))
    return fail(ErrorCode::kInvalid,
                "prediction plane " + std::to_string(prediction_plane_) +
                    " with normals from plane " + std::to_string(normal_planes_) + " on; of " +
                    std::to_string(count) + " planes it must be one and they three others");
  for (std::size_t k = 0; k < planes_.size(); ++k) {
    const PlaneDescription& plane = planes_[k];
    if (is_normal(k) && (plane.bit_depth != 16 || plane.mantissa_shift != 0 || plane.has_exponent))
      return fail(ErrorCode::kInvalid, plane_name(k) +
                                           ": normals have 16 bits a texel of the light map, and "
                                           "no exponents");
  }
  return {};
}

bool PlaneSheets::is_normal(std::size_t plane) const {
  const auto first = static_cast<std::size_t>(normal_planes_);
  return normal_planes_ >= 0 && plane >= first && plane < first + kNormalPlanes;
}

bool PlaneSheets::can_predict(int slot) const {
  if (prediction_plane_ < 0) return false;
  const auto s = static_cast<std::size_t>(prediction_plane_);
  const auto first = static_cast<std::size_t>(normal_planes_);
  bool present = state(s, slot).present;
  for (std::size_t k = first; k < first + kNormalPlanes; ++k)
    present = present && state(k, slot).present;
  return present;
}

void PlaneSheets::add_tile(const PlaneSetDescription& d, std::size_t plane, bool exponent) {
  const PlaneDescription& p = d.planes[plane];
  const PicturePlace& at = exponent ? p.exponent : p.mantissa;
  Tile tile;
  tile.exponent = exponent;
  tile.shift = exponent ? p.exponent_shift : p.mantissa_shift;
  tile.width = shifted(d.width, tile.shift);
  tile.height = shifted(d.height, tile.shift);
  std::size_t index = tiles_.size();
  if (at.picture >= 0) {
    for (std::size_t t = 0; t < tiles_.size(); ++t) {
      const PlaneDescription& other = d.planes[tiles_[t].planes.front()];
      const PicturePlace& there = exponent ? other.exponent : other.mantissa;
      if (tiles_[t].exponent == exponent && tiles_[t].shift == tile.shift &&
          there.picture == at.picture && there.x == at.x && there.y == at.y &&
          other.bit_depth == p.bit_depth)
        index = t;
    }
  }
  if (index == tiles_.size()) tiles_.push_back(tile);
  tiles_[index].planes.push_back(static_cast<std::uint32_t>(plane));
  Place& place = exponent ? exponents_[plane] : mantissas_[plane];
  place.tile = static_cast<int>(index);
  place.shift = tile.shift;
}

void PlaneSheets::make_regions(const PlaneSetDescription& d, int limit) {
  struct Box {
    int x0 = INT32_MAX, y0 = INT32_MAX, x1 = 0, y1 = 0;
    std::int64_t used = 0;
    std::vector<std::uint32_t> tiles;
  };
  auto place_of = [&](const Tile& tile) -> const PicturePlace& {
    const PlaneDescription& plane = d.planes[tile.planes.front()];
    return tile.exponent ? plane.exponent : plane.mantissa;
  };
  auto is_wide = [&](const Tile& tile) {
    return !tile.exponent && d.planes[tile.planes.front()].bit_depth > 8;
  };
  // Keyed so that neighbours in a box agree in everything that an upload needs.
  std::map<std::array<int, 4>, Box> boxes;
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    const Tile& tile = tiles_[t];
    const PicturePlace& at = place_of(tile);
    const int lonely = at.picture < 0 ? static_cast<int>(t) : -1;
    Box& box = boxes[{tile.exponent, is_wide(tile), at.picture, lonely}];
    box.x0 = std::min(box.x0, at.x);
    box.y0 = std::min(box.y0, at.y);
    box.x1 = std::max(box.x1, at.x + tile.width);
    box.y1 = std::max(box.y1, at.y + tile.height);
    box.used += std::int64_t{tile.width} * tile.height;
    box.tiles.push_back(static_cast<std::uint32_t>(t));
  }
  auto add_region = [&](const std::vector<std::uint32_t>& tiles, int x0, int y0, int width,
                        int height) {
    Region region;
    region.wide = is_wide(tiles_[tiles.front()]);
    region.width = width;
    region.height = height;
    region.tiles = tiles;
    for (const std::uint32_t t : tiles) {
      tiles_[t].region = static_cast<int>(regions_.size());
      tiles_[t].x = place_of(tiles_[t]).x - x0;
      tiles_[t].y = place_of(tiles_[t]).y - y0;
    }
    regions_.push_back(std::move(region));
  };
  for (const auto& [key, box] : boxes) {
    const int width = box.x1 - box.x0;
    const int height = box.y1 - box.y0;
    // A box that is half empty costs more to upload than its tiles do one by one.
    const bool dense = std::int64_t{width} * height <= 2 * box.used;
    if (dense && width <= limit && height <= limit) {
      add_region(box.tiles, box.x0, box.y0, width, height);
      continue;
    }
    for (const std::uint32_t t : box.tiles)
      add_region({t}, place_of(tiles_[t]).x, place_of(tiles_[t]).y, tiles_[t].width,
                 tiles_[t].height);
  }
}

// Shelves: tallest first, side by side until a row is full, rows one below the other.
Status PlaneSheets::pack(int limit) {
  std::vector<std::uint32_t> order(regions_.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::uint32_t>(i);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return regions_[a].height > regions_[b].height;
  });
  for (const bool wide : {false, true}) {
    std::int64_t area = 0;
    int shelf_width = 0;
    for (const Region& region : regions_) {
      if (region.wide != wide) continue;
      if (region.width > limit || region.height > limit)
        return fail(ErrorCode::kLimit, "a plane of " + std::to_string(region.width) + "x" +
                                           std::to_string(region.height) +
                                           " samples, but a texture holds at most " +
                                           std::to_string(limit) +
                                           " a side here; composite on the CPU (--backend cpu)");
      area += std::int64_t{region.width} * region.height;
      shelf_width = std::max(shelf_width, region.width);
    }
    shelf_width = std::max(
        shelf_width,
        std::min(limit, static_cast<int>(std::ceil(std::sqrt(static_cast<double>(area))))));
    int x = 0, y = 0, shelf_height = 0;
    int sheet = -1;
    for (const std::uint32_t index : order) {
      Region& region = regions_[index];
      if (region.wide != wide) continue;
      if (x + region.width > shelf_width) {
        y += shelf_height;
        x = 0;
        shelf_height = 0;
      }
      if (sheet < 0 || y + region.height > limit) {
        sheet = static_cast<int>(sheets_.size());
        sheets_.emplace_back().wide = wide;
        x = y = shelf_height = 0;
      }
      region.sheet = sheet;
      region.x = x;
      region.y = y;
      x += region.width;
      shelf_height = std::max(shelf_height, region.height);
      Sheet& target = sheets_[static_cast<std::size_t>(sheet)];
      target.width = std::max(target.width, region.x + region.width);
      target.height = std::max(target.height, region.y + region.height);
    }
  }
  return {};
}

void PlaneSheets::make_textures() {
  for (Sheet& sheet : sheets_) {
    TextureFormat format;
    if (device_->is_es3()) {
      format.internal_format = sheet.wide ? GL_RG8 : GL_R8;
      format.format = sheet.wide ? GL_RG : GL_RED;
    } else {
      format.format = sheet.wide ? GL_LUMINANCE_ALPHA : GL_LUMINANCE;
      format.internal_format = static_cast<GLint>(format.format);
    }
    for (int i = 0; i < slot_count_; ++i)
      sheet.textures[static_cast<std::size_t>(i)] =
          make_texture(*device_, format, sheet.width, sheet.height);
  }
  for (const Region& region : regions_) {
    for (const std::uint32_t t : region.tiles) {
      const Tile& tile = tiles_[t];
      for (const std::uint32_t plane : tile.planes) {
        Place& place = tile.exponent ? exponents_[plane] : mantissas_[plane];
        place.sheet = region.sheet;
        place.x = region.x + tile.x;
        place.y = region.y + tile.y;
      }
    }
  }
  // Rows of a picture are longer than the region's. Without a row length they are copied together.
  staging_.resize(largest_region_bytes());
}

std::size_t PlaneSheets::largest_region_bytes() const {
  std::size_t largest = 0;
  for (const Region& region : regions_) {
    largest =
        std::max(largest, static_cast<std::size_t>(region.width) *
                              static_cast<std::size_t>(region.height) * (region.wide ? 2 : 1));
  }
  return largest;
}

Status PlaneSheets::upload(std::span<const PlaneView> planes, int slot,
                           std::span<const std::uint8_t> wanted, bool keep) {
  if (planes.size() != planes_.size() || (!wanted.empty() && wanted.size() != planes_.size()))
    return fail(ErrorCode::kInvalid, std::to_string(planes.size()) + " planes to upload, " +
                                         std::to_string(planes_.size()) + " were described");
  if (slot < 0 || slot >= slot_count_)
    return fail(ErrorCode::kInvalid,
                "planes for slot " + std::to_string(slot) + " of " + std::to_string(slot_count_));
  std::vector<PlaneState>& states = states_[static_cast<std::size_t>(slot)];
  for (std::size_t k = 0; k < planes.size(); ++k) {
    active_[k] = !planes[k].mantissa.empty() && (wanted.empty() || wanted[k] != 0) &&
                 !(keep && states[k].present);
    if (active_[k] != 0) RELIT_TRY(check_view(k, planes[k]));
  }
  device_->gl().PixelStorei(GL_UNPACK_ALIGNMENT, 1);
  for (const Region& region : regions_) upload_region(region, planes, slot);
  std::fill(tile_exponents_.begin(), tile_exponents_.end(), -1);
  for (std::size_t k = 0; k < planes.size(); ++k) {
    if (active_[k] != 0) {
      note_state(k, planes[k], states[k]);
    } else if (!keep) {
      states[k] = {};
    }
  }
  return {};
}

Status PlaneSheets::check_view(std::size_t k, const PlaneView& view) const {
  const PlaneDescription& d = planes_[k];
  const int bytes = d.bit_depth > 8 ? 2 : 1;
  auto covers = [&](const SampleView& samples, int shift) {
    return samples.width >= shifted(width_, shift) && samples.height >= shifted(height_, shift);
  };
  if (view.mantissa.bytes_per_sample != bytes || view.mantissa_shift != d.mantissa_shift ||
      view.mantissa_zero != 1 << (d.bit_depth - 1) || !covers(view.mantissa, d.mantissa_shift))
    return fail(ErrorCode::kInvalid, plane_name(k) + ": its mantissas are not as described");
  if (view.exponent.empty() == d.has_exponent ||
      (d.has_exponent &&
       (view.exponent.bytes_per_sample != 1 || view.exponent_shift != d.exponent_shift ||
        !covers(view.exponent, d.exponent_shift))))
    return fail(ErrorCode::kInvalid, plane_name(k) + ": its exponents are not as described");
  if (!std::isfinite(view.scale))
    return fail(ErrorCode::kInvalid, plane_name(k) + ": its scale is not a finite number");
  // The shader has it as a literal.
  if (is_normal(k) && view.scale != kNormalScale)
    return fail(ErrorCode::kInvalid, plane_name(k) + ": the scale of a normal is 1/32767");
  return {};
}

const SampleView* PlaneSheets::find_view(const Tile& tile,
                                         std::span<const PlaneView> planes) const {
  for (const std::uint32_t k : tile.planes)
    if (active_[k] != 0) return tile.exponent ? &planes[k].exponent : &planes[k].mantissa;
  return nullptr;
}

void PlaneSheets::upload_region(const Region& region, std::span<const PlaneView> planes, int slot) {
  const SampleView* first = nullptr;
  const std::uint8_t* origin = nullptr;
  bool one_picture = true;
  int x0 = region.width, y0 = region.height, x1 = 0, y1 = 0;  // what has to go up
  for (const std::uint32_t t : region.tiles) {
    const Tile& tile = tiles_[t];
    const SampleView* view = find_view(tile, planes);
    if (view == nullptr) continue;
    const std::uint8_t* start =
        view->data - tile.y * view->stride_bytes - std::ptrdiff_t{tile.x} * view->bytes_per_sample;
    if (first == nullptr) {
      first = view;
      origin = start;
    }
    one_picture = one_picture && start == origin && view->stride_bytes == first->stride_bytes;
    x0 = std::min(x0, tile.x), x1 = std::max(x1, tile.x + tile.width);
    y0 = std::min(y0, tile.y), y1 = std::max(y1, tile.y + tile.height);
  }
  if (first == nullptr) return;
  if (one_picture) {
    const std::uint8_t* corner =
        origin + y0 * first->stride_bytes + std::ptrdiff_t{x0} * first->bytes_per_sample;
    upload_rectangle(region, region.x + x0, region.y + y0,
                     {corner, first->stride_bytes, x1 - x0, y1 - y0, first->bytes_per_sample},
                     slot);
    return;
  }
  // The views lie elsewhere than was described, for example after an error was concealed.
  for (const std::uint32_t t : region.tiles) {
    const SampleView* view = find_view(tiles_[t], planes);
    if (view == nullptr) continue;
    SampleView cropped = *view;
    cropped.width = tiles_[t].width;
    cropped.height = tiles_[t].height;
    upload_rectangle(region, region.x + tiles_[t].x, region.y + tiles_[t].y, cropped, slot);
  }
}

void PlaneSheets::upload_rectangle(const Region& region, int x, int y, const SampleView& samples,
                                   int slot) const {
  const Functions& gl = device_->gl();
  const Sheet& sheet = sheets_[static_cast<std::size_t>(region.sheet)];
  const GLenum format = device_->is_es3() ? (region.wide ? GL_RG : GL_RED)
                                          : (region.wide ? GL_LUMINANCE_ALPHA : GL_LUMINANCE);
  const std::ptrdiff_t row_bytes = std::ptrdiff_t{samples.width} * samples.bytes_per_sample;
  const std::uint8_t* data = samples.data;
  const bool packed = samples.stride_bytes == row_bytes;
  const bool row_length = !packed && device_->caps().unpack_row_length &&
                          samples.stride_bytes > row_bytes &&
                          samples.stride_bytes % samples.bytes_per_sample == 0;
  if (row_length) {
    gl.PixelStorei(GL_UNPACK_ROW_LENGTH,
                   static_cast<GLint>(samples.stride_bytes / samples.bytes_per_sample));
  } else if (!packed) {
    for (int row = 0; row < samples.height; ++row)
      std::memcpy(staging_.data() + row * row_bytes, samples.data + row * samples.stride_bytes,
                  static_cast<std::size_t>(row_bytes));
    data = staging_.data();
  }
  gl.BindTexture(GL_TEXTURE_2D, sheet.textures[static_cast<std::size_t>(slot)].name());
  gl.TexSubImage2D(GL_TEXTURE_2D, 0, x, y, samples.width, samples.height, format, GL_UNSIGNED_BYTE,
                   data);
  if (row_length) gl.PixelStorei(GL_UNPACK_ROW_LENGTH, 0);
}

void PlaneSheets::note_state(std::size_t k, const PlaneView& view, PlaneState& state) {
  state = {};
  state.present = true;
  int exponent = view.exponent_zero;
  if (planes_[k].has_exponent) {
    int& largest = tile_exponents_[static_cast<std::size_t>(exponents_[k].tile)];
    if (largest < 0) {
      largest = 0;
      const int columns = shifted(width_, planes_[k].exponent_shift);
      const int rows = shifted(height_, planes_[k].exponent_shift);
      for (int y = 0; y < rows; ++y) {
        const std::uint8_t* row = view.exponent.data + y * view.exponent.stride_bytes;
        std::uint8_t most = 0;
        for (int x = 0; x < columns; ++x) most = std::max(most, row[x]);
        largest = std::max(largest, int{most});
      }
    }
    exponent = largest;
    state.exponent_reference = largest;
  }
  state.factor = std::ldexp(double{view.scale} * view.mantissa_zero, exponent - view.exponent_zero);
}

std::array<float, 4> PlaneSheets::coordinates(const Place& place) const {
  const Sheet& sheet = sheets_[static_cast<std::size_t>(place.sheet)];
  const double width = sheet.width;
  const double height = sheet.height;
  // At texel centres x+½ the shifted coordinate lies a quarter of a sample or more (shift 1), at
  // least 1/64 (shift 5), away from the next sample: nearest filtering needs no floor().
  const double step = std::ldexp(1.0, -place.shift);
  return {static_cast<float>(place.x / width), static_cast<float>(place.y / height),
          static_cast<float>(step / width), static_cast<float>(step / height)};
}

GLuint PlaneSheets::texture(int sheet, int slot) const {
  return sheets_[static_cast<std::size_t>(sheet)].textures[static_cast<std::size_t>(slot)].name();
}

std::size_t PlaneSheets::gpu_bytes() const {
  std::size_t bytes = 0;
  for (const Sheet& sheet : sheets_)
    bytes += static_cast<std::size_t>(sheet.width) * static_cast<std::size_t>(sheet.height) *
             (sheet.wide ? 2u : 1u) * static_cast<std::size_t>(slot_count_);
  return bytes;
}

}  // namespace relit::gles
