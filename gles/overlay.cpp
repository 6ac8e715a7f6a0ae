// SPDX-License-Identifier: MIT
#include "gles/overlay.hpp"

#include <cstddef>

#include "container/base/out_of_memory.hpp"
#include "gles/shaders.hpp"

namespace relit::gles {
namespace {

using Vertex = OverlayCanvas::Vertex;

constexpr GLuint kOverlayPosition = 0, kOverlayTexel = 1, kOverlayColor = 2;

void set_attributes(const Functions& gl) {
  const auto offset = [](std::size_t bytes) { return reinterpret_cast<const void*>(bytes); };
  gl.VertexAttribPointer(kOverlayPosition, 2, GL_FLOAT, GL_FALSE, sizeof(Vertex),
                         offset(offsetof(Vertex, x)));
  gl.VertexAttribPointer(kOverlayTexel, 2, GL_UNSIGNED_SHORT, GL_FALSE, sizeof(Vertex),
                         offset(offsetof(Vertex, u)));
  gl.VertexAttribPointer(kOverlayColor, 4, GL_UNSIGNED_BYTE, GL_TRUE, sizeof(Vertex),
                         offset(offsetof(Vertex, color)));
  for (const GLuint attribute : {kOverlayPosition, kOverlayTexel, kOverlayColor})
    gl.EnableVertexAttribArray(attribute);
}

}  // namespace

Result<std::unique_ptr<Overlay>> Overlay::create(const Device& device) {
  return catch_out_of_memory("creating the overlay", [&]() -> Result<std::unique_ptr<Overlay>> {
    std::unique_ptr<Overlay> overlay(new Overlay(device));
    const Functions& gl = device.gl();
    StateGuard guard(device);
    const std::string_view vertex[] = {shaders::overlay_vert};
    const std::string_view fragment[] = {shaders::overlay_frag};
    const std::string_view attributes[] = {"a_position", "a_texel", "a_color"};
    RELIT_ASSIGN(overlay->program_, build_program(gl, device.profile(),
                                                  {"overlay", "", vertex, fragment, attributes}));
    overlay->to_clip_ = gl.GetUniformLocation(overlay->program_.name(), "u_to_clip");
    overlay->to_atlas_ = gl.GetUniformLocation(overlay->program_.name(), "u_to_atlas");
    overlay->vertices_ = Buffer(gl);
    if (device.is_es3()) {
      overlay->array_ = VertexArray(gl);
      gl.BindVertexArray(overlay->array_.name());
      gl.BindBuffer(GL_ARRAY_BUFFER, overlay->vertices_.name());
      set_attributes(gl);
      gl.BindVertexArray(0);
    }
    RELIT_TRY(device.check("creating the overlay"));
    return overlay;
  });
}

Status Overlay::upload(const FontAtlas& atlas) {
  TextureFormat format;
  format.internal_format = device_.is_es3() ? GL_R8 : GL_LUMINANCE;
  format.format = device_.is_es3() ? GL_RED : GL_LUMINANCE;
  format.bytes_per_texel = 1;
  letters_ = make_texture(device_, format, atlas.width(), atlas.height(), atlas.coverage().data());
  letters_scale_ = atlas.scale();
  return device_.check("uploading the overlay's letters");
}

Status Overlay::draw(const OverlayCanvas& canvas) {
  RELIT_TRY(device_.ready("drawing the overlay"));
  if (canvas.vertices().empty()) return {};
  const Functions& gl = device_.gl();
  const FontAtlas& atlas = canvas.atlas();
  StateGuard guard(device_);
  if (letters_scale_ != atlas.scale()) RELIT_TRY(upload(atlas));
  const auto scale = static_cast<float>(canvas.scale());
  const float width = canvas.width() * scale, height = canvas.height() * scale;
  gl.Viewport(0, 0, static_cast<GLsizei>(width + 0.5f), static_cast<GLsizei>(height + 0.5f));
  gl.Enable(GL_BLEND);
  gl.BlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  gl.UseProgram(program_.name());
  gl.Uniform2f(to_clip_, 2 / width, -2 / height);
  gl.Uniform2f(to_atlas_, 1 / static_cast<float>(atlas.width()),
               1 / static_cast<float>(atlas.height()));
  gl.BindTexture(GL_TEXTURE_2D, letters_.name());
  gl.BindBuffer(GL_ARRAY_BUFFER, vertices_.name());
  // New storage every time: the driver need not wait for the picture that still reads the old one.
  gl.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(canvas.vertices().size() * sizeof(Vertex)),
                canvas.vertices().data(), GL_STREAM_DRAW);
  if (device_.is_es3()) {
    gl.BindVertexArray(array_.name());
  } else {
    set_attributes(gl);
  }
  gl.DrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(canvas.vertices().size()));
  if (device_.is_es3()) {
    gl.BindVertexArray(0);
  } else {
    for (const GLuint attribute : {kOverlayPosition, kOverlayTexel, kOverlayColor})
      gl.DisableVertexAttribArray(attribute);
  }
  return device_.check("drawing the overlay");
}

}  // namespace relit::gles
