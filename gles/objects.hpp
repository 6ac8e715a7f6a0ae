// SPDX-License-Identifier: MIT
#pragma once

#include <utility>

#include "gles/functions.hpp"

namespace relit::gles {

enum class ObjectKind { kTexture, kBuffer, kFramebuffer, kRenderbuffer, kVertexArray, kProgram };

/// Owns one GL object. The table and the context must outlive it, and the context must be current
/// where it is destroyed.
template <ObjectKind K>
class Object {
 public:
  Object() = default;
  /// Generates a name; a program is created.
  explicit Object(const Functions& gl) : gl_(&gl) {
    if constexpr (K == ObjectKind::kTexture) gl.GenTextures(1, &name_);
    if constexpr (K == ObjectKind::kBuffer) gl.GenBuffers(1, &name_);
    if constexpr (K == ObjectKind::kFramebuffer) gl.GenFramebuffers(1, &name_);
    if constexpr (K == ObjectKind::kRenderbuffer) gl.GenRenderbuffers(1, &name_);
    if constexpr (K == ObjectKind::kVertexArray) gl.GenVertexArrays(1, &name_);
    if constexpr (K == ObjectKind::kProgram) name_ = gl.CreateProgram();
  }
  Object(Object&& other) noexcept : gl_(other.gl_), name_(std::exchange(other.name_, 0u)) {}
  Object& operator=(Object&& other) noexcept {
    std::swap(gl_, other.gl_);
    std::swap(name_, other.name_);
    return *this;
  }
  Object(const Object&) = delete;
  Object& operator=(const Object&) = delete;
  ~Object() {
    if (name_ == 0) return;
    if constexpr (K == ObjectKind::kTexture) gl_->DeleteTextures(1, &name_);
    if constexpr (K == ObjectKind::kBuffer) gl_->DeleteBuffers(1, &name_);
    if constexpr (K == ObjectKind::kFramebuffer) gl_->DeleteFramebuffers(1, &name_);
    if constexpr (K == ObjectKind::kRenderbuffer) gl_->DeleteRenderbuffers(1, &name_);
    if constexpr (K == ObjectKind::kVertexArray) gl_->DeleteVertexArrays(1, &name_);
    if constexpr (K == ObjectKind::kProgram) gl_->DeleteProgram(name_);
  }

  [[nodiscard]] GLuint name() const { return name_; }
  explicit operator bool() const { return name_ != 0; }

 private:
  const Functions* gl_ = nullptr;
  GLuint name_ = 0;
};

using Texture = Object<ObjectKind::kTexture>;
using Buffer = Object<ObjectKind::kBuffer>;
using FramebufferObject = Object<ObjectKind::kFramebuffer>;
using Renderbuffer = Object<ObjectKind::kRenderbuffer>;
using VertexArray = Object<ObjectKind::kVertexArray>;
using Program = Object<ObjectKind::kProgram>;

}  // namespace relit::gles
