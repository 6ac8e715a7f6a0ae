// SPDX-License-Identifier: MIT
#include "gles/character_renderer.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/type_ptr.hpp>

#include "container/base/limits.hpp"
#include "gles/shaders.hpp"

namespace relit::gles {
namespace {

float wrap_code(Wrap wrap) {
  return wrap == Wrap::kClamp ? 0.0f : wrap == Wrap::kRepeat ? 1.0f : 2.0f;
}

bool is_finite(const glm::mat4& m) {
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      if (!std::isfinite(m[i][j])) return false;
  return true;
}

GLintptr bytes(std::size_t count, std::size_t size) { return static_cast<GLintptr>(count * size); }

const void* offset(std::size_t at) { return reinterpret_cast<const void*>(at); }

}  // namespace

Result<std::unique_ptr<CharacterRenderer>> CharacterRenderer::create(const Device& device) {
  std::unique_ptr<CharacterRenderer> renderer(new CharacterRenderer(device));
  RELIT_ASSIGN(renderer->background_, BackgroundRenderer::create(device));
  return renderer;
}

Status CharacterRenderer::set_materials(std::span<const ImageView> images,
                                        std::span<const MaterialView> materials) {
  return set_materials(
      images.size(), [&](std::size_t i) { return std::optional(images[i]); }, materials);
}

Status CharacterRenderer::set_materials(std::size_t image_count, const ImageLoader& load,
                                        std::span<const MaterialView> materials) {
  RELIT_ASSIGN(materials_, MaterialTextures::create(device_, image_count, load, materials));
  return {};
}

Status CharacterRenderer::check_mesh(const MeshView& mesh, std::size_t index) const {
  const std::string name = "mesh " + std::to_string(index);
  const std::size_t n = mesh.vertex_count;
  if (n < 1 || n > limits::kVerticesPerMesh || mesh.indices.size() > limits::kIndicesPerMesh)
    return fail(ErrorCode::kLimit, name + ": " + std::to_string(n) + " vertices, " +
                                       std::to_string(mesh.indices.size()) +
                                       " indices; 1 to 65535 vertices are possible");
  auto fits = [&](std::size_t size) { return size == 0 || size == n; };
  if (mesh.lightmap_uv.size() != n || !fits(mesh.albedo_uv.size()) || !fits(mesh.colors.size()) ||
      mesh.indices.size() % 3 != 0)
    return fail(ErrorCode::kInvalid,
                name +
                    ": its attributes do not have one entry per vertex, or its "
                    "indices are no triangles");
  if (std::any_of(mesh.indices.begin(), mesh.indices.end(),
                  [&](std::uint16_t i) { return i >= n; }))
    return fail(ErrorCode::kInvalid, name + ": an index is out of range");
  for (const std::span<const glm::vec2> uvs : {mesh.lightmap_uv, mesh.albedo_uv})
    for (const glm::vec2& uv : uvs)
      if (!std::isfinite(uv.x) || !std::isfinite(uv.y))
        return fail(ErrorCode::kInvalid, name + ": a texture coordinate is not finite");
  return {};
}

Status CharacterRenderer::set_meshes(std::span<const MeshView> meshes) {
  RELIT_TRY(device_.ready("uploading meshes"));
  if (meshes.size() > limits::kMeshes)
    return fail(ErrorCode::kLimit, std::to_string(meshes.size()) + " meshes; at most " +
                                       std::to_string(limits::kMeshes) + " are possible");
  for (std::size_t i = 0; i < meshes.size(); ++i) RELIT_TRY(check_mesh(meshes[i], i));
  StateGuard guard(device_);
  std::vector<Mesh> uploaded;
  uploaded.reserve(meshes.size());
  mesh_bytes_ = 0;
  for (const MeshView& view : meshes) {
    uploaded.push_back(upload_mesh(view));
    mesh_bytes_ += view.vertex_count * (sizeof(glm::vec3) + sizeof(glm::vec2)) +
                   view.albedo_uv.size_bytes() + view.colors.size_bytes() +
                   view.indices.size_bytes();
  }
  RELIT_TRY(device_.check("uploading meshes"));
  meshes_ = std::move(uploaded);
  order_.resize(meshes_.size());
  depths_.resize(meshes_.size());
  return {};
}

CharacterRenderer::Mesh CharacterRenderer::upload_mesh(const MeshView& view) const {
  const Functions& gl = device_.gl();
  Mesh mesh;
  mesh.vertex_count = view.vertex_count;
  mesh.index_count = static_cast<GLsizei>(view.indices.size());
  mesh.material = view.material;
  mesh.has_albedo_uv = !view.albedo_uv.empty();
  mesh.has_color = !view.colors.empty();
  mesh.positions = Buffer(gl);
  mesh.attributes = Buffer(gl);
  mesh.indices = Buffer(gl);
  std::vector<std::uint8_t> packed;
  auto append = [&](const auto& span) {
    const auto* first = reinterpret_cast<const std::uint8_t*>(span.data());
    packed.insert(packed.end(), first, first + span.size_bytes());
  };
  append(view.lightmap_uv);
  append(view.albedo_uv);
  append(view.colors);
  if (device_.is_es3()) {
    mesh.array = VertexArray(gl);
    gl.BindVertexArray(mesh.array.name());
  }
  gl.BindBuffer(GL_ARRAY_BUFFER, mesh.attributes.name());
  gl.BufferData(GL_ARRAY_BUFFER, bytes(packed.size(), 1), packed.data(), GL_STATIC_DRAW);
  gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, mesh.indices.name());
  gl.BufferData(GL_ELEMENT_ARRAY_BUFFER, bytes(view.indices.size(), sizeof(std::uint16_t)),
                view.indices.data(), GL_STATIC_DRAW);
  if (device_.is_es3()) {
    set_attributes(mesh);
    gl.BindVertexArray(0);
  } else {
    gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, 0);
  }
  return mesh;
}

void CharacterRenderer::set_attributes(const Mesh& mesh) const {
  const Functions& gl = device_.gl();
  gl.BindBuffer(GL_ARRAY_BUFFER, mesh.positions.name());
  gl.VertexAttribPointer(kPosition, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
  gl.BindBuffer(GL_ARRAY_BUFFER, mesh.attributes.name());
  std::size_t at = mesh.vertex_count * sizeof(glm::vec2);
  gl.VertexAttribPointer(kLightMapUv, 2, GL_FLOAT, GL_FALSE, 0, nullptr);
  gl.VertexAttribPointer(kAlbedoUv, 2, GL_FLOAT, GL_FALSE, 0,
                         mesh.has_albedo_uv ? offset(at) : nullptr);
  if (mesh.has_albedo_uv) at *= 2;
  for (const GLuint attribute : {kPosition, kLightMapUv, kAlbedoUv})
    gl.EnableVertexAttribArray(attribute);
  if (mesh.has_color) {
    gl.VertexAttribPointer(kColor, 4, GL_UNSIGNED_BYTE, GL_TRUE, 0, offset(at));
    gl.EnableVertexAttribArray(kColor);
  }
}

Status CharacterRenderer::update_positions(std::size_t index,
                                           std::span<const glm::vec3> positions) {
  if (index >= meshes_.size() || positions.size() != meshes_[index].vertex_count)
    return fail(ErrorCode::kInvalid, "mesh " + std::to_string(index) + " gets " +
                                         std::to_string(positions.size()) +
                                         " positions; it does not exist or has another number");
  RELIT_TRY(device_.ready("updating positions"));
  Mesh& mesh = meshes_[index];
  const std::uint32_t material = mesh.material;
  if (material < materials_.materials().size() &&
      materials_.materials()[material].material.alpha_mode == AlphaMode::kBlend) {
    glm::vec3 low = positions[0], high = positions[0];
    for (const glm::vec3& p : positions) {
      low = glm::min(low, p);
      high = glm::max(high, p);
    }
    mesh.centre = 0.5f * (low + high);
  }
  const Functions& gl = device_.gl();
  gl.BindBuffer(GL_ARRAY_BUFFER, mesh.positions.name());
  // New storage every time: the driver need not wait for the frame that still reads the old one.
  gl.BufferData(GL_ARRAY_BUFFER, bytes(positions.size(), sizeof(glm::vec3)), positions.data(),
                GL_STREAM_DRAW);
  gl.BindBuffer(GL_ARRAY_BUFFER, 0);
  mesh.has_positions = true;
  return {};
}

void CharacterRenderer::sort_meshes(const View& view) {
  auto is_blended = [&](std::uint32_t i) {
    return materials_.materials()[meshes_[i].material].material.alpha_mode == AlphaMode::kBlend;
  };
  for (std::uint32_t i = 0; i < order_.size(); ++i) {
    order_[i] = i;
    depths_[i] = (view.view * glm::vec4(meshes_[i].centre, 1)).z;
  }
  std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
    const bool blended = is_blended(a);
    if (blended != is_blended(b)) return !blended;
    if (blended && depths_[a] != depths_[b]) return depths_[a] < depths_[b];
    if (!blended && meshes_[a].material != meshes_[b].material)
      return meshes_[a].material < meshes_[b].material;
    return a < b;
  });
}

Status CharacterRenderer::draw(const View& view, const LightMap& map) {
  return draw(view, Light{&map, nullptr});
}

Status CharacterRenderer::draw(const View& view, FusedLight& light) {
  return draw(view, Light{nullptr, &light});
}

Status CharacterRenderer::draw_background(const View& view) {
  RELIT_TRY(device_.ready("drawing"));
  if (!std::isfinite(view.exposure) || !(view.exposure >= 0) || view.width < 1 || view.height < 1)
    return fail(ErrorCode::kInvalid, "the view's size or its exposure make no sense");
  StateGuard guard(device_);
  device_.gl().Viewport(view.x, view.y, view.width, view.height);
  RELIT_TRY(background_.draw(view));
  return device_.check("drawing");
}

Status CharacterRenderer::draw(const View& view, const Light& light) {
  RELIT_TRY(device_.ready("drawing"));
  if (!is_finite(view.view) || !is_finite(view.projection) ||
      !std::isfinite(view.exposure * light.scale()) || !(view.exposure >= 0) || view.width < 1 ||
      view.height < 1)
    return fail(ErrorCode::kInvalid,
                "the view's matrices, its size or its exposure times the light make no sense");
  for (const Mesh& mesh : meshes_)
    if (mesh.material >= materials_.materials().size())
      return fail(ErrorCode::kInvalid,
                  "a mesh uses material " + std::to_string(mesh.material) + ", but only " +
                      std::to_string(materials_.materials().size()) + " are set");
  const Functions& gl = device_.gl();
  StateGuard guard(device_, light.fused != nullptr ? std::max(2, light.fused->unit_count()) : 2);
  gl.Viewport(view.x, view.y, view.width, view.height);
  RELIT_TRY(background_.draw(view));
  view_projection_ = view.projection * view.view;
  sort_meshes(view);
  gl.Enable(GL_DEPTH_TEST);
  gl.Enable(GL_CULL_FACE);
  gl.BlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  if (light.fused != nullptr) {
    light.fused->bind(gl);
  } else {
    gl.BindTexture(GL_TEXTURE_2D, light.map->texture);
  }
  for (const std::uint32_t index : order_)
    if (meshes_[index].has_positions) RELIT_TRY(draw_with_material(meshes_[index], view, light));
  return device_.check("drawing");
}

Status CharacterRenderer::draw_with_material(const Mesh& mesh, const View& view,
                                             const Light& light) {
  const Functions& gl = device_.gl();
  const MaterialTexture& entry = materials_.materials()[mesh.material];
  const MaterialView& material = entry.material;
  auto found = light.fused != nullptr
                   ? light.fused->shaders().find(device_, entry, view.tone_map, *light.fused)
                   : shaders_.find(device_, entry, view.tone_map, *light.map);
  RELIT_ASSIGN(CharacterShader * shader, std::move(found));
  gl.UseProgram(shader->program.name());
  gl.UniformMatrix4fv(shader->view_projection, 1, GL_FALSE, glm::value_ptr(view_projection_));
  gl.Uniform4f(shader->base_color, material.base_color[0], material.base_color[1],
               material.base_color[2], material.base_color[3]);
  gl.Uniform1f(shader->alpha_cutoff, material.alpha_cutoff);
  gl.Uniform2f(shader->wrap, wrap_code(material.wrap_u), wrap_code(material.wrap_v));
  set_light(*shader, view, light);
  if (light.fused != nullptr) light.fused->apply(gl, *shader);
  if (entry.texture >= 0) {
    gl.ActiveTexture(GL_TEXTURE1);
    gl.BindTexture(GL_TEXTURE_2D, materials_.texture(entry.texture));
    gl.ActiveTexture(GL_TEXTURE0);
  }
  if (material.alpha_mode == AlphaMode::kBlend) {
    gl.Enable(GL_BLEND);
    gl.DepthMask(GL_FALSE);
  }
  draw_mesh(mesh);
  return {};
}

void CharacterRenderer::set_light(const CharacterShader& shader, const View& view,
                                  const Light& light) const {
  const Functions& gl = device_.gl();
  const float scale = view.exposure * light.scale();
  // A half float that overflows would make black NaN.
  const bool half = device_.profile() == Profile::kEs2Mediump;
  gl.Uniform1f(shader.light_scale, half ? std::min(scale, 60000.0f) : scale);
  constexpr std::array<float, 4> kWhole{1, 1, 0, 0};
  const std::array<float, 4>& place = light.map != nullptr ? light.map->place : kWhole;
  gl.Uniform4f(shader.light_map_place, place[0], place[1], place[2], place[3]);
  if (light.map == nullptr) return;
  const auto width = static_cast<float>(light.map->width);
  const auto height = static_cast<float>(light.map->height);
  gl.Uniform4f(shader.light_map_size, width, height, 1 / width, 1 / height);
}

void CharacterRenderer::draw_mesh(const Mesh& mesh) const {
  const Functions& gl = device_.gl();
  if (device_.is_es3()) {
    gl.BindVertexArray(mesh.array.name());
  } else {
    set_attributes(mesh);
    gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, mesh.indices.name());
  }
  if (!mesh.has_color) gl.VertexAttrib4f(kColor, 1, 1, 1, 1);
  gl.DrawElements(GL_TRIANGLES, mesh.index_count, GL_UNSIGNED_SHORT, nullptr);
  if (device_.is_es3()) {
    gl.BindVertexArray(0);
    return;
  }
  gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, 0);
  for (const GLuint attribute : {kPosition, kLightMapUv, kAlbedoUv, kColor})
    gl.DisableVertexAttribArray(attribute);
}

std::size_t CharacterRenderer::gpu_bytes() const { return mesh_bytes_ + materials_.gpu_bytes(); }

}  // namespace relit::gles
