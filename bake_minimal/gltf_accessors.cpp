// SPDX-License-Identifier: MIT
#include "bake_minimal/gltf_accessors.hpp"

#include <algorithm>
#include <cstring>
#include <span>

namespace relit::bake::gltf {
namespace {

/// Elements of one accessor. Without a bufferView nothing else bounds the count.
constexpr std::size_t kAccessorElements = std::size_t{1} << 26;

int component_bytes(int component_type) {
  switch (component_type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return 2;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return 4;
    default:
      return 0;
  }
}

int component_count(int type) {
  switch (type) {
    case TINYGLTF_TYPE_SCALAR:
      return 1;
    case TINYGLTF_TYPE_VEC2:
      return 2;
    case TINYGLTF_TYPE_VEC3:
      return 3;
    case TINYGLTF_TYPE_VEC4:
      return 4;
    case TINYGLTF_TYPE_MAT4:
      return 16;
    default:
      return 0;
  }
}

template <class T>
T load(const std::uint8_t* p) {
  T value;
  std::memcpy(&value, p, sizeof value);
  return value;
}

float load_float(const std::uint8_t* p, int component_type, bool normalized) {
  switch (component_type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE: {
      const auto v = static_cast<float>(load<std::int8_t>(p));
      return normalized ? std::max(v / 127.0f, -1.0f) : v;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: {
      const auto v = static_cast<float>(*p);
      return normalized ? v / 255.0f : v;
    }
    case TINYGLTF_COMPONENT_TYPE_SHORT: {
      const auto v = static_cast<float>(load<std::int16_t>(p));
      return normalized ? std::max(v / 32767.0f, -1.0f) : v;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: {
      const auto v = static_cast<float>(load<std::uint16_t>(p));
      return normalized ? v / 65535.0f : v;
    }
    default:
      return load<float>(p);
  }
}

std::uint32_t load_unsigned(const std::uint8_t* p, int component_type) {
  switch (component_type) {
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return *p;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return load<std::uint16_t>(p);
    default:
      return load<std::uint32_t>(p);
  }
}

/// Elements in a buffer view: element i begins at data + i * stride.
struct Elements {
  const std::uint8_t* data = nullptr;  ///< null: all zero
  std::size_t stride = 0;
};

struct Layout {
  std::string where;
  std::size_t count = 0;
  std::size_t offset = 0;
  std::size_t element_bytes = 0;
};

Result<Elements> find_elements(const Document& document, int buffer_view, const Layout& layout) {
  RELIT_ASSIGN(const auto bytes, document.view_bytes(buffer_view, layout.where));
  const std::size_t declared =
      document.model.bufferViews[static_cast<std::size_t>(buffer_view)].byteStride;
  const std::size_t stride = declared == 0 ? layout.element_bytes : declared;
  if (stride < layout.element_bytes) {
    return document.fail(ErrorCode::kCorrupt, layout.where,
                         "byteStride " + std::to_string(stride) + " is less than the " +
                             std::to_string(layout.element_bytes) +
                             " bytes of an element; export the file again");
  }
  // count is at most kAccessorElements and stride at most 252, so nothing here overflows.
  const std::size_t needed =
      layout.count == 0 ? 0 : (layout.count - 1) * stride + layout.element_bytes;
  if (layout.offset > bytes.size() || needed > bytes.size() - layout.offset) {
    return document.fail(ErrorCode::kCorrupt, layout.where,
                         "its " + std::to_string(layout.count) + " elements need " +
                             std::to_string(needed) + " bytes from " +
                             std::to_string(layout.offset) + ", but bufferView " +
                             std::to_string(buffer_view) + " has " + std::to_string(bytes.size()) +
                             "; export the file again");
  }
  return Elements{bytes.data() + layout.offset, stride};
}

/// An accessor whose bytes are known to be there.
struct Source {
  const tinygltf::Accessor* accessor = nullptr;
  std::string where;
  int components = 0;
  int component_bytes = 0;
  Elements base;
  std::vector<std::uint32_t> sparse_indices;
  Elements sparse_values;

  [[nodiscard]] std::size_t element_bytes() const {
    return static_cast<std::size_t>(components) * static_cast<std::size_t>(component_bytes);
  }
};

Status find_sparse(const Document& document, Source& source) {
  const auto& sparse = source.accessor->sparse;
  const std::string where = source.where + ", sparse";
  if (sparse.count < 0 || static_cast<std::size_t>(sparse.count) > source.accessor->count ||
      sparse.indices.byteOffset < 0 || sparse.values.byteOffset < 0) {
    return document.fail(ErrorCode::kCorrupt, where,
                         "count " + std::to_string(sparse.count) + " is not in 0.." +
                             std::to_string(source.accessor->count) +
                             " or an offset is negative; export the file again");
  }
  const int type = sparse.indices.componentType;
  if (type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE &&
      type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
      type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT) {
    return document.fail(
        ErrorCode::kCorrupt, where,
        "indices have component type " + std::to_string(type) + "; it must be 5121, 5123 or 5125");
  }
  const auto count = static_cast<std::size_t>(sparse.count);
  RELIT_ASSIGN(
      const Elements indices,
      find_elements(document, sparse.indices.bufferView,
                    {where + " indices", count, static_cast<std::size_t>(sparse.indices.byteOffset),
                     static_cast<std::size_t>(component_bytes(type))}));
  RELIT_ASSIGN(
      source.sparse_values,
      find_elements(document, sparse.values.bufferView,
                    {where + " values", count, static_cast<std::size_t>(sparse.values.byteOffset),
                     source.element_bytes()}));
  source.sparse_indices.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t index = load_unsigned(indices.data + i * indices.stride, type);
    if (index >= source.accessor->count || (i > 0 && index <= source.sparse_indices[i - 1])) {
      return document.fail(ErrorCode::kCorrupt, where,
                           "index " + std::to_string(index) + " at " + std::to_string(i) +
                               " is not below the count " + std::to_string(source.accessor->count) +
                               " or not above the one before; export the file again");
    }
    source.sparse_indices[i] = index;
  }
  return {};
}

Result<Source> find_source(const Document& document, int index, const AccessorUse& use) {
  if (!in_range(index, document.model.accessors.size())) {
    return document.fail(ErrorCode::kCorrupt, use.where,
                         "accessor " + std::to_string(index) + " does not exist; there are " +
                             std::to_string(document.model.accessors.size()));
  }
  Source source;
  source.accessor = &document.model.accessors[static_cast<std::size_t>(index)];
  source.where =
      use.where + ", " + label("accessor", static_cast<std::size_t>(index), source.accessor->name);
  source.components = component_count(source.accessor->type);
  source.component_bytes = component_bytes(source.accessor->componentType);
  if (source.component_bytes == 0 || source.components == 0 ||
      (source.components != use.components && source.components != use.other_components)) {
    return document.fail(ErrorCode::kCorrupt, source.where,
                         "type or component type " +
                             std::to_string(source.accessor->componentType) +
                             " does not fit; it must have " + std::to_string(use.components) +
                             " components of glTF's number types");
  }
  if (source.accessor->count > kAccessorElements) {
    return document.fail(ErrorCode::kLimit, source.where,
                         std::to_string(source.accessor->count) + " elements; at most " +
                             std::to_string(kAccessorElements) + " are taken: split the mesh");
  }
  if (source.accessor->bufferView >= 0) {
    RELIT_ASSIGN(source.base, find_elements(document, source.accessor->bufferView,
                                            {source.where, source.accessor->count,
                                             source.accessor->byteOffset, source.element_bytes()}));
  }
  if (source.accessor->sparse.isSparse) RELIT_TRY(find_sparse(document, source));
  return source;
}

/// Calls `write(component index, pointer)` for the components that are not zero by default; later
/// calls replace earlier ones.
template <class Write>
void for_components(const Source& source, Write&& write) {
  const auto components = static_cast<std::size_t>(source.components);
  const auto bytes = static_cast<std::size_t>(source.component_bytes);
  if (source.base.data != nullptr) {
    for (std::size_t i = 0; i < source.accessor->count; ++i) {
      for (std::size_t c = 0; c < components; ++c) {
        write(i * components + c, source.base.data + i * source.base.stride + c * bytes);
      }
    }
  }
  for (std::size_t i = 0; i < source.sparse_indices.size(); ++i) {
    for (std::size_t c = 0; c < components; ++c) {
      write(source.sparse_indices[i] * components + c,
            source.sparse_values.data + i * source.sparse_values.stride + c * bytes);
    }
  }
}

}  // namespace

Result<Numbers> read_numbers(const Document& document, int accessor, const AccessorUse& use) {
  RELIT_ASSIGN(const Source source, find_source(document, accessor, use));
  const int type = source.accessor->componentType;
  const bool normalized = source.accessor->normalized;
  if (type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT ||
      (type != TINYGLTF_COMPONENT_TYPE_FLOAT && !normalized && !use.integers_are_values)) {
    return document.fail(ErrorCode::kCorrupt, source.where,
                         "integers that are not normalized do not fit here; write floats or "
                         "normalized 8- or 16-bit integers");
  }
  Numbers out{source.components, source.accessor->count, {}};
  out.values.resize(out.count * static_cast<std::size_t>(source.components));
  for_components(source, [&](std::size_t i, const std::uint8_t* p) {
    out.values[i] = load_float(p, type, normalized);
  });
  return out;
}

Result<Integers> read_integers(const Document& document, int accessor, const AccessorUse& use) {
  RELIT_ASSIGN(const Source source, find_source(document, accessor, use));
  const int type = source.accessor->componentType;
  if (type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE &&
      type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
      type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT) {
    return document.fail(ErrorCode::kCorrupt, source.where,
                         "component type " + std::to_string(type) +
                             " does not fit; it must be an unsigned integer (5121, 5123 or 5125)");
  }
  Integers out{source.components, source.accessor->count, {}};
  out.values.resize(out.count * static_cast<std::size_t>(source.components));
  for_components(source, [&](std::size_t i, const std::uint8_t* p) {
    out.values[i] = load_unsigned(p, type);
  });
  return out;
}

}  // namespace relit::bake::gltf
