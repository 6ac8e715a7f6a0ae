// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "container/base/result.hpp"
#include "container/records.hpp"

/// What the baker knows of a glTF file: geometry by node instance, materials, hierarchy and clips.
/// Space: glTF's own (right-handed, +Y up, metres); matrices act on column vectors.
namespace relit::bake {

/// A picture with its decoded texels. 8 bits a channel; sRGB or linear is the user's matter.
struct Image {
  std::string name;
  std::string media_type;             ///< "image/png" or "image/jpeg", by its bytes
  std::vector<std::uint8_t> encoded;  ///< as the glTF had it
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgba;  ///< height × width × 4
};

struct TextureUse {
  int image = -1;  ///< into Scene::images; -1: none
  int texcoord = 0;
  container::Wrap wrap_u = container::Wrap::kRepeat;
  container::Wrap wrap_v = container::Wrap::kRepeat;
  bool linear_filter = true;
  glm::mat3 uv_transform{1.0f};  ///< KHR_texture_transform: uv' = (M · (u, v, 1)).xy
};

struct Material {
  std::string name;
  glm::vec4 base_color{1.0f};  ///< linear, in [0,1]
  float metallic = 0;          ///< factor; times the texture's blue channel where there is one
  TextureUse base_color_texture;
  TextureUse metallic_texture;
  container::AlphaMode alpha_mode = container::AlphaMode::kOpaque;
  float alpha_cutoff = 0.5f;
  bool double_sided = false;
};

struct MorphDelta {
  std::vector<glm::vec3> positions;
  std::vector<glm::vec3> normals;  ///< may be empty
};

/// A triangle list with one material, once for every node that shows it. All vertex vectors have
/// positions.size() entries. Vertices that no triangle uses and triangles without area are gone;
/// triangles are counter-clockwise from the front in the rest pose, mirrored nodes included.
struct Primitive {
  std::string name;  ///< of its mesh; with "/k" where the mesh has several primitives
  int material = 0;  ///< into Scene::materials, always valid (a default one is added if needed)
  int node = -1;     ///< that carries the mesh
  int skin = -1;     ///< into Scene::skins, or -1: rigid with its node
  std::vector<glm::vec3> positions;
  std::vector<glm::vec3> normals;  ///< unit length; computed where the file has none
  /// By set; zeros for a set that only the material knows.
  std::vector<std::vector<glm::vec2>> texcoords;
  std::vector<glm::vec4> colors;      ///< linear; may be empty
  int influences_per_vertex = 0;      ///< 0, 4 or 8
  std::vector<std::uint16_t> joints;  ///< into the skin's joints
  std::vector<float> weights;         ///< normalised
  std::vector<MorphDelta> morph_targets;
  std::uint32_t first_morph_weight = 0;  ///< into the pose's morph weights
  std::vector<std::uint32_t> indices;

  std::vector<glm::vec2> lightmap_uv;  ///< filled by assign_lightmap_uvs()
  /// For double-sided materials, after assign_lightmap_uvs(): triangle t and triangle
  /// other_side[t] are the two sides of one surface. Empty: single-sided.
  std::vector<std::uint32_t> other_side;
};

struct Trs {
  glm::vec3 translation{0.0f};
  glm::quat rotation{1.0f, 0.0f, 0.0f, 0.0f};
  glm::vec3 scale{1.0f};
};

struct Node {
  std::string name;
  int parent = -1;  ///< parents may come after their children in glTF; not here
  Trs local;
  std::optional<glm::mat4> matrix;  ///< instead of `local`; such nodes are never animated
};

struct Skin {
  std::vector<int> joints;  ///< nodes
  std::vector<glm::mat4> inverse_bind;
};

enum class Path : std::uint8_t { kTranslation, kRotation, kScale, kWeights };
enum class Interpolation : std::uint8_t { kStep, kLinear, kCubicSpline };

struct Channel {
  Path path = Path::kTranslation;
  int node = -1;
  Interpolation interpolation = Interpolation::kLinear;
  std::vector<float> times;   ///< strictly increasing, finite
  std::vector<float> values;  ///< components × times, × 3 for cubic splines, as in glTF
  std::uint32_t first_morph_weight = 0;  ///< kWeights: where in the pose its components go
};

struct Clip {
  std::string name;       ///< an unnamed animation is called by its number in the file
  double duration_s = 0;  ///< the largest key time, at most a day; clips start at 0. 0: one pose
  std::vector<Channel> channels;
};

/// Node transforms and morph weights of one instant.
struct ScenePose {
  std::vector<Trs> local;            ///< by node
  std::vector<float> morph_weights;  ///< by Primitive::first_morph_weight
};

struct Scene {
  std::filesystem::path path;
  std::vector<Image> images;
  std::vector<Material> materials;
  std::vector<Primitive> primitives;
  std::vector<Node> nodes;  ///< parents first
  std::vector<Skin> skins;
  std::vector<Clip> clips;
  std::uint32_t morph_weight_count = 0;
  std::vector<float> default_morph_weights;
  std::vector<std::string> warnings;  ///< what was ignored, for the user

  /// The pose at `time_s` of `clip` (-1: the rest pose), keys held outside their range. Rotations
  /// come out of unit length. Reuses the memory of `pose`.
  void sample(int clip, double time_s, ScenePose& pose) const;
  /// World matrices of all nodes.
  void world_matrices(const ScenePose& pose, std::vector<glm::mat4>& world) const;
  /// Positions and normals of a primitive in model space (double-checked reference for the player's
  /// quantised pose; same conventions: node transform ignored where there is a skin). Normals go
  /// through the inverse transpose (cofactors times the determinant's sign) and have unit length.
  /// Either span may be empty, else it has positions.size() entries.
  void pose_primitive(const Primitive& primitive, const ScenePose& pose,
                      std::span<const glm::mat4> world, std::span<glm::vec3> positions,
                      std::span<glm::vec3> normals) const;
};

/// Loads .gltf or .glb. Errors name the file, the place (mesh, accessor, …) and the remedy.
[[nodiscard]] Result<Scene> load_gltf(const std::filesystem::path& path);

/// A clip's index by its name or, where no clip has that name, by its number. Errors: kNotFound,
/// with the names that there are.
[[nodiscard]] Result<int> find_clip(const Scene& scene, std::string_view name_or_number);

struct Bounds {
  glm::vec3 min{0.0f};
  glm::vec3 max{0.0f};
};

/// The box around all primitives over the frames k/fps < duration_s of a clip (at least frame 0;
/// -1: the rest pose), metres. Errors: kInvalid where a posed position is not finite (names it), or
/// for a frame rate that is not positive.
[[nodiscard]] Result<Bounds> clip_bounds(const Scene& scene, int clip, double fps);

}  // namespace relit::bake
