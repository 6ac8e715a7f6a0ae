// SPDX-License-Identifier: MIT
// Draws pictures of a character without a window: egl_pictures FILE.relit PREFIX [PICTURES]
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GLES2/gl2.h>
#include <math.h>
#include <relit.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { kSide = 720, kScale = 2, kDrawn = kSide * kScale };  // drawn larger, for smooth edges

static void* get_proc_address(void* user, const char* name) {
  (void)user;
  return (void*)(uintptr_t)eglGetProcAddress(name);
}

// A context without a window where Mesa can, on the default display elsewhere.
static int open_context(void) {
  static const EGLint kSurface[] = {EGL_WIDTH, kDrawn, EGL_HEIGHT, kDrawn, EGL_NONE};
  static const EGLint kVersion[] = {EGL_CONTEXT_CLIENT_VERSION, 2, EGL_NONE};
  const PFNEGLGETPLATFORMDISPLAYEXTPROC get_display =
      (PFNEGLGETPLATFORMDISPLAYEXTPROC)eglGetProcAddress("eglGetPlatformDisplayEXT");
  EGLDisplay display = get_display ? get_display(EGL_PLATFORM_SURFACELESS_MESA, NULL, NULL) : NULL;
  if (!display || !eglInitialize(display, NULL, NULL)) {
    display = eglGetDisplay(EGL_DEFAULT_DISPLAY);
    if (!display || !eglInitialize(display, NULL, NULL)) return 0;
  }
  // clang-format off
  const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_ES2_BIT,
                           EGL_ALPHA_SIZE, 8, EGL_DEPTH_SIZE, 16, EGL_NONE};
  // clang-format on
  EGLConfig config;
  EGLint count = 0;
  if (!eglChooseConfig(display, wanted, &config, 1, &count) || count < 1) return 0;
  EGLSurface surface = eglCreatePbufferSurface(display, config, kSurface);
  EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, kVersion);
  return surface && context && eglMakeCurrent(display, surface, surface, context);
}

// Adds a lamp far away in `direction` (of unit length): radiance as spherical harmonics.
static void add_lamp(float light[9][3], const float d[3], const float color[3]) {
  // clang-format off
  const float y[9] = {0.282095f, 0.488603f * d[1], 0.488603f * d[2], 0.488603f * d[0],
                      1.092548f * d[0] * d[1], 1.092548f * d[1] * d[2], 0.315392f * (3 * d[2] * d[2] - 1),
                      1.092548f * d[0] * d[2], 0.546274f * (d[0] * d[0] - d[1] * d[1])};
  // clang-format on
  for (int n = 0; n < 9; ++n)
    for (int c = 0; c < 3; ++c) light[n][c] += y[n] * color[c];
}

// A camera in front of the middle of the box, a little to the right and above, that sees all of it.
static void look_at(relit_view* view, const relit_clip_info* clip) {
  const float azimuth = 0.45f, elevation = 0.16f, tangent = 0.26f;
  float middle[3], radius = 0;
  for (int i = 0; i < 3; ++i) {
    const float half = 0.5f * (clip->bounds_max[i] - clip->bounds_min[i]);
    middle[i] = clip->bounds_min[i] + half;
    radius += half * half;
  }
  radius = sqrtf(radius);
  const float distance = 0.85f * radius / tangent, near = distance - 1.2f * radius;
  const float far = distance + 1.2f * radius;
  const float back[3] = {sinf(azimuth) * cosf(elevation), sinf(elevation),
                         cosf(azimuth) * cosf(elevation)};
  const float right[3] = {cosf(azimuth), 0, -sinf(azimuth)};
  const float up[3] = {back[1] * right[2], back[2] * right[0] - back[0] * right[2],
                       -back[1] * right[0]};
  for (int i = 0; i < 3; ++i) {
    view->view[4 * i + 0] = right[i];
    view->view[4 * i + 1] = up[i];
    view->view[4 * i + 2] = back[i];
    view->view[12] -= right[i] * middle[i];
    view->view[13] -= up[i] * middle[i];
    view->view[14] -= back[i] * middle[i];
  }
  view->view[14] -= distance;
  memset(view->projection, 0, sizeof view->projection);
  view->projection[0] = view->projection[5] = 1 / tangent;
  view->projection[10] = -(far + near) / (far - near);
  view->projection[11] = -1;
  view->projection[14] = -2 * far * near / (far - near);
}

static int write_ppm(const char* prefix, unsigned number, const uint8_t* rgba) {
  char name[512];
  snprintf(name, sizeof name, "%s%03u.ppm", prefix, number);
  FILE* file = fopen(name, "wb");
  if (!file) return 0;
  fprintf(file, "P6\n%d %d\n255\n", kSide, kSide);
  for (int i = 0; i < kSide * kSide; ++i) {
    const uint8_t* p = rgba + 4 * kScale * ((kSide - 1 - i / kSide) * kDrawn + i % kSide);
    for (int c = 0; c < 3; ++c)
      fputc((p[c] + p[c + 4] + p[c + 4 * kDrawn] + p[c + 4 * kDrawn + 4] + 2) / 4, file);
  }
  return fclose(file) == 0;
}

static relit_result draw_pictures(relit_player* player, const char* prefix, unsigned count) {
  float light[9][3] = {{0}};
  const float sun[3] = {0.86f, 0.40f, 0.31f}, sky[3] = {-0.6f, 0.8f, 0};
  add_lamp(light, sun, (const float[3]){5.4f, 4.2f, 2.8f});
  add_lamp(light, sky, (const float[3]){0.5f, 0.9f, 1.7f});
  for (int c = 0; c < 3; ++c) light[0][c] += 0.35f;  // and a little from everywhere
  relit_clip_info clip = {.struct_size = sizeof clip};
  relit_view view;
  relit_result result = relit_view_default(&view, sizeof view);
  if (!result) result = relit_set_light_sh(player, &light[0][0], 9);
  if (!result) result = relit_clip(player, 0, &clip);
  if (!result) result = relit_auto_exposure(player, &view.exposure);
  if (result) return result;
  look_at(&view, &clip);
  view.width = view.height = kDrawn;
  view.background = RELIT_BACKGROUND_COLOR;
  for (int c = 0; c < 3; ++c) view.background_color[c] = 0.14f + 0.03f * (float)c;
  uint8_t* rgba = malloc(4 * kDrawn * kDrawn);
  for (unsigned i = 0; i < count && rgba && !result; ++i) {
    result = relit_seek(player, clip.duration_s * i / count);
    if (!result) result = relit_wait(player, 10, NULL);
    if (!result) result = relit_draw(player, &view);
    if (result) break;
    glReadPixels(0, 0, kDrawn, kDrawn, GL_RGBA, GL_UNSIGNED_BYTE, rgba);
    if (!write_ppm(prefix, i, rgba)) perror(prefix);
  }
  free(rgba);
  return result;
}

int main(int argc, char** argv) {
  if (argc < 3) return fprintf(stderr, "usage: %s FILE.relit PREFIX [PICTURES]\n", argv[0]), 2;
  if (!open_context()) return fprintf(stderr, "no EGL context\n"), 2;
  relit_player* player = NULL;
  relit_result result = relit_open(argv[1], NULL, &player);
  relit_gl_options gl;
  relit_gl_options_default(&gl, sizeof gl);
  gl.get_proc_address = get_proc_address;
  if (!result) result = relit_gl_attach(player, &gl);
  if (!result) result = draw_pictures(player, argv[2], argc > 3 ? (unsigned)atoi(argv[3]) : 1);
  if (result) fprintf(stderr, "%s: %s\n", relit_result_name(result), relit_last_error(player));
  relit_close(player);  // the context is current, so this detaches too
  return result ? 1 : 0;
}
