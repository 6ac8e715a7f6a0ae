// SPDX-License-Identifier: MIT
#pragma once

#include <tiny_gltf.h>

#include <cstdint>
#include <filesystem>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "container/base/result.hpp"

/// The steps of load_gltf(); nothing outside the gltf_*.cpp files includes these headers.
namespace relit::bake::gltf {

/// An image of the file: its bytes, or why they cannot be had. Only an image that a shown material
/// uses is an error then.
struct EncodedImage {
  std::string name;
  std::string media_type;  ///< as the file claims; may be empty
  std::string uri;         ///< empty: `buffer_view`
  int buffer_view = -1;
};

/// A parsed file and its bytes. Indexes inside `model` are unchecked unless said otherwise.
struct Document {
  std::filesystem::path path;
  tinygltf::Model model;  ///< without buffers and images: those are here
  std::vector<std::vector<std::uint8_t>> buffers;
  std::vector<EncodedImage> images;
  std::set<std::size_t> emptied_animations;  ///< whose channels all move something but nodes
  std::vector<std::string> warnings;

  /// An Error whose message is "file: where: what".
  [[nodiscard]] Unexpected fail(ErrorCode code, const std::string& where,
                                const std::string& what) const;
  void warn(const std::string& where, const std::string& what);

  /// The bytes of a buffer view, bounds checked. `where` names who asks. Errors: kCorrupt.
  [[nodiscard]] Result<std::span<const std::uint8_t>> view_bytes(int buffer_view,
                                                                 const std::string& where) const;
};

/// `mesh 3 "Body"`, or `mesh 3` without a name.
[[nodiscard]] std::string label(const char* kind, std::size_t index, const std::string& name);

/// True if `index` is one of `count` things.
[[nodiscard]] constexpr bool in_range(int index, std::size_t count) {
  return index >= 0 && static_cast<std::size_t>(index) < count;
}

/// Reads a whole file. Errors: kIo (missing, a directory, unreadable), kLimit beyond 4 GiB.
[[nodiscard]] Result<std::vector<std::uint8_t>> read_file(const std::filesystem::path& path);

/// Parses the bytes of a .gltf or .glb file (told apart by their content) and fetches its buffers;
/// `path` is for messages and relative URIs. Every required extension of the result is supported.
/// Errors: kTruncated, kCorrupt, kUnsupported, kIo, kLimit.
[[nodiscard]] Result<Document> parse_document(std::span<const std::uint8_t> bytes,
                                              const std::filesystem::path& path);

}  // namespace relit::bake::gltf
