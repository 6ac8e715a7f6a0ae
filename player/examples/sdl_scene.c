// SPDX-License-Identifier: MIT
// A character in a scene of the host's own: relit gives its light map as a texture and its posed
// vertices, everything is drawn by the shaders below. sdl_scene FILE.relit [PICTURES]
#include <GLES2/gl2.h>
#include <SDL.h>
#include <math.h>
#include <relit.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { kPosition = 0, kUv = 1, kAlbedoUv = 2, kNormal = 1, kColor = 2, kFootprint = 256 };
static const float kSky[3] = {0.36f, 0.47f, 0.60f};  // linear

// ---- shaders

#define TONE                                                          \
  "precision highp float;\n"                                          \
  "uniform float u_exposure; uniform vec3 u_sky; uniform vec3 u_eye;" \
  "vec4 display(vec3 radiance, float distance) {"                     \
  "  vec3 c = 1.0 - exp(-1.15 * u_exposure * radiance);"              \
  "  c = mix(c, u_sky, smoothstep(3.5, 14.0, distance));"             \
  "  return vec4(pow(c, vec3(1.0 / 2.2)), 1.0); }\n"

static const char* const kCharacterVertex =
    "attribute vec3 a_position; attribute vec2 a_uv; attribute vec2 a_albedo_uv;"
    "uniform mat4 u_matrix; varying vec2 v_uv; varying vec2 v_albedo_uv;"
    "void main() { v_uv = a_uv; v_albedo_uv = a_albedo_uv;"
    "  gl_Position = u_matrix * vec4(a_position, 1.0); }";
static const char* const kCharacterFragment = TONE
    "varying vec2 v_uv; varying vec2 v_albedo_uv;"
    "uniform sampler2D u_light_map; uniform sampler2D u_albedo;"
    "uniform float u_scale; uniform bool u_square_root; uniform vec3 u_base_color;"
    "void main() {"
    "  vec3 light = texture2D(u_light_map, v_uv).rgb;"
    "  if (u_square_root) light *= light;"
    "  vec3 albedo = u_base_color * pow(texture2D(u_albedo, v_albedo_uv).rgb, vec3(2.2));"
    "  gl_FragColor = display(max(light, 0.0) * u_scale * albedo, 0.0); }";

// The host's own things take the same light as the character, without its shadows.
static const char* const kSceneVertex =
    "attribute vec3 a_position; attribute vec3 a_normal; attribute vec3 a_color;"
    "uniform mat4 u_matrix; varying vec3 v_position; varying vec3 v_normal; varying vec3 v_color;"
    "void main() { v_position = a_position; v_normal = a_normal; v_color = a_color;"
    "  gl_Position = u_matrix * vec4(a_position, 1.0); }";
static const char* const kSceneFragment = TONE
    "varying vec3 v_position; varying vec3 v_normal; varying vec3 v_color;"
    "uniform vec3 u_sh[9]; uniform sampler2D u_footprint; uniform float u_reach; uniform float "
    "u_floor;"
    "vec3 irradiance(vec3 n) {"  // over pi
    "  vec3 e = 0.282095 * u_sh[0];"
    "  e += 0.325735 * (u_sh[1] * n.y + u_sh[2] * n.z + u_sh[3] * n.x);"
    "  e += 0.273137 * (u_sh[4] * n.x * n.y + u_sh[5] * n.y * n.z + u_sh[7] * n.x * n.z);"
    "  e += 0.078848 * u_sh[6] * (3.0 * n.z * n.z - 1.0);"
    "  return max(e + 0.136569 * u_sh[8] * (n.x * n.x - n.y * n.y), 0.0); }"
    "float shade() {"  // what the character's shadow leaves
    "  vec2 at = v_position.xz / u_reach * 0.5 + 0.5; float sum = 0.0;"
    "  for (int y = -2; y <= 2; ++y) for (int x = -2; x <= 2; ++x)"
    "    sum += texture2D(u_footprint, at + vec2(float(x), float(y)) * 0.008).r;"
    "  return 1.0 - 0.62 * sum / 25.0; }"
    "void main() {"
    "  vec3 color = v_color; float lit = 1.0;"
    "  if (v_normal.y > 0.5 && v_position.y < u_floor + 0.001) {"
    "    vec2 tile = abs(fract(v_position.xz * 1.25) - 0.5);"
    "    color *= mix(1.0, 0.62, smoothstep(0.485, 0.492, max(tile.x, tile.y)));"
    "    lit = shade(); }"
    "  gl_FragColor = display(color * lit * irradiance(v_normal), length(v_position - u_eye)); }";

static const char* const kFootprintVertex =
    "attribute vec3 a_position; uniform vec3 u_sun; uniform float u_reach; uniform float u_floor;"
    "void main() { vec3 p = a_position - u_sun * ((a_position.y - u_floor) / u_sun.y);"
    "  gl_Position = vec4(p.xz / u_reach, 0.0, 1.0); }";
static const char* const kFootprintFragment = "void main() { gl_FragColor = vec4(1.0); }";

static GLuint compile(GLenum kind, const char* text) {
  const GLuint shader = glCreateShader(kind);
  glShaderSource(shader, 1, &text, NULL);
  glCompileShader(shader);
  return shader;
}

static GLuint build(const char* vertex, const char* fragment, const char* second,
                    const char* third) {
  const GLuint program = glCreateProgram();
  glAttachShader(program, compile(GL_VERTEX_SHADER, vertex));
  glAttachShader(program, compile(GL_FRAGMENT_SHADER, fragment));
  glBindAttribLocation(program, kPosition, "a_position");
  glBindAttribLocation(program, 1, second);
  glBindAttribLocation(program, 2, third);
  glLinkProgram(program);
  GLint linked = 0;
  char log[1024] = "";
  glGetProgramiv(program, GL_LINK_STATUS, &linked);
  if (!linked) glGetProgramInfoLog(program, sizeof log, NULL, log);
  if (!linked) fprintf(stderr, "%s\n", log);
  return linked ? program : 0;
}

static GLint at(GLuint program, const char* name) { return glGetUniformLocation(program, name); }

// ---- the character, as relit gives it

typedef struct Mesh {
  relit_mesh_info info;
  GLuint positions, uv, albedo_uv, indices, albedo;
  float base_color[3];
} Mesh;

typedef struct Character {
  relit_player* player;
  relit_clip_info clip;
  Mesh* meshes;
  uint32_t mesh_count;
  float* positions;  // room for the largest mesh
} Character;

static GLuint upload(GLenum target, const void* data, size_t bytes) {
  GLuint buffer = 0;
  glGenBuffers(1, &buffer);
  glBindBuffer(target, buffer);
  glBufferData(target, (GLsizeiptr)bytes, data, GL_STATIC_DRAW);
  return buffer;
}

static GLuint make_texture(int width, int height, const void* rgba) {
  GLuint texture = 0;
  glGenTextures(1, &texture);
  glBindTexture(GL_TEXTURE_2D, texture);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, rgba);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return texture;
}

static GLuint load_albedo(relit_player* player, int32_t image) {
  static const uint8_t kWhite[4] = {255, 255, 255, 255};
  int32_t width = 0, height = 0;
  if (image < 0 || relit_image(player, (uint32_t)image, &width, &height, NULL, 0))
    return make_texture(1, 1, kWhite);
  const size_t bytes = 4 * (size_t)width * (size_t)height;
  uint8_t* rgba = malloc(bytes);
  if (!rgba || relit_image(player, (uint32_t)image, &width, &height, rgba, bytes)) width = 0;
  const GLuint texture = width > 0 ? make_texture(width, height, rgba) : make_texture(1, 1, kWhite);
  free(rgba);
  return texture;
}

static relit_result load_character(Character* c) {
  size_t most = 0;
  c->clip.struct_size = sizeof c->clip;
  relit_result result = relit_clip(c->player, 0, &c->clip);
  c->mesh_count = relit_mesh_count(c->player);
  c->meshes = calloc(c->mesh_count, sizeof *c->meshes);
  for (uint32_t i = 0; i < c->mesh_count && !result; ++i) {
    Mesh* mesh = &c->meshes[i];
    relit_material_info material = {.struct_size = sizeof material};
    mesh->info.struct_size = sizeof mesh->info;
    result = relit_mesh(c->player, i, &mesh->info);
    if (!result) result = relit_material(c->player, mesh->info.material, &material);
    if (result) return result;
    const size_t n = mesh->info.vertex_count;
    const float* albedo_uv = mesh->info.albedo_uv ? mesh->info.albedo_uv : mesh->info.lightmap_uv;
    if (n > most) most = n;
    memcpy(mesh->base_color, material.base_color, sizeof mesh->base_color);
    mesh->albedo = load_albedo(c->player, material.image);
    mesh->uv = upload(GL_ARRAY_BUFFER, mesh->info.lightmap_uv, n * 2 * sizeof(float));
    mesh->albedo_uv = upload(GL_ARRAY_BUFFER, albedo_uv, n * 2 * sizeof(float));
    mesh->indices = upload(GL_ELEMENT_ARRAY_BUFFER, mesh->info.indices,
                           mesh->info.index_count * sizeof(uint16_t));
    glGenBuffers(1, &mesh->positions);
  }
  c->positions = malloc(most * 3 * sizeof(float));
  return result ? result : c->positions ? RELIT_OK : RELIT_OUT_OF_MEMORY;
}

// The vertices of the moment go up.
static relit_result pose(Character* c) {
  for (uint32_t i = 0; i < c->mesh_count; ++i) {
    const size_t n = c->meshes[i].info.vertex_count;
    const relit_result result = relit_posed_vertices(c->player, i, c->positions, NULL, n);
    if (result) return result;
    glBindBuffer(GL_ARRAY_BUFFER, c->meshes[i].positions);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(n * 3 * sizeof(float)), c->positions,
                 GL_STREAM_DRAW);
  }
  return RELIT_OK;
}

static void attribute(GLuint index, GLuint buffer, GLint size, GLsizei stride, size_t offset) {
  glBindBuffer(GL_ARRAY_BUFFER, buffer);
  glEnableVertexAttribArray(index);
  glVertexAttribPointer(index, size, GL_FLOAT, GL_FALSE, stride, (const void*)offset);
}

static void draw_meshes(const Character* c, GLuint program, int textured) {
  for (uint32_t i = 0; i < c->mesh_count; ++i) {
    const Mesh* mesh = &c->meshes[i];
    attribute(kPosition, mesh->positions, 3, 0, 0);
    if (textured) {
      attribute(kUv, mesh->uv, 2, 0, 0);
      attribute(kAlbedoUv, mesh->albedo_uv, 2, 0, 0);
      glUniform3fv(at(program, "u_base_color"), 1, mesh->base_color);
      glActiveTexture(GL_TEXTURE1);
      glBindTexture(GL_TEXTURE_2D, mesh->albedo);
      glActiveTexture(GL_TEXTURE0);
    }
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, mesh->indices);
    glDrawElements(GL_TRIANGLES, (GLsizei)mesh->info.index_count, GL_UNSIGNED_SHORT, NULL);
  }
  for (GLuint index = 0; index < 3; ++index) glDisableVertexAttribArray(index);
}

// ---- the host's scene: a floor and some boxes, position, normal and colour a vertex

typedef struct Scene {
  float vertices[9 * 36 * 8];
  GLsizei count;
  GLuint buffer, footprint, framebuffer;
} Scene;

static void add_box(Scene* scene, const float low[3], const float high[3], const float color[3]) {
  static const int kCorners[6] = {0, 1, 2, 2, 1, 3};
  for (int side = 0; side < 6; ++side)
    for (int k = 0; k < 6; ++k) {
      const int axis = side / 2, positive = side % 2;
      // Counter-clockwise from outside: the order of the two other axes turns with the side.
      const int u = (axis + (positive ? 1 : 2)) % 3, v = (axis + (positive ? 2 : 1)) % 3;
      float* out = scene->vertices + 9 * scene->count++;
      memset(out, 0, 9 * sizeof *out);
      out[axis] = positive ? high[axis] : low[axis];
      out[u] = kCorners[k] & 1 ? high[u] : low[u];
      out[v] = kCorners[k] & 2 ? high[v] : low[v];
      out[3 + axis] = positive ? 1.0f : -1.0f;
      memcpy(out + 6, color, 3 * sizeof *color);
    }
}

static void make_scene(Scene* scene, float floor) {
  static const float kBoxes[5][6] = {{-1.9f, 0, -1.6f, -1.1f, 0.8f, -0.9f},
                                     {-1.65f, 0.8f, -1.45f, -1.2f, 1.2f, -1.05f},
                                     {1.0f, 0, -1.9f, 1.6f, 1.5f, -1.3f},
                                     {1.15f, 0, -0.8f, 1.55f, 0.4f, -0.4f},
                                     {-1.5f, 0, 0.55f, -1.2f, 0.3f, 0.85f}};
  static const float kColors[5][3] = {{0.62f, 0.24f, 0.14f},
                                      {0.75f, 0.62f, 0.36f},
                                      {0.18f, 0.34f, 0.44f},
                                      {0.70f, 0.68f, 0.62f},
                                      {0.30f, 0.42f, 0.22f}};
  const float low[3] = {-20, floor - 0.2f, -20}, high[3] = {20, floor, 20};
  const float stone[3] = {0.36f, 0.33f, 0.30f};
  add_box(scene, low, high, stone);
  for (int i = 0; i < 5; ++i) {
    const float* b = kBoxes[i];
    const float from[3] = {b[0], floor + b[1], b[2]}, to[3] = {b[3], floor + b[4], b[5]};
    add_box(scene, from, to, kColors[i]);
  }
  scene->buffer =
      upload(GL_ARRAY_BUFFER, scene->vertices, (size_t)scene->count * 9 * sizeof(float));
  scene->footprint = make_texture(kFootprint, kFootprint, NULL);
  glGenFramebuffers(1, &scene->framebuffer);
  glBindFramebuffer(GL_FRAMEBUFFER, scene->framebuffer);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, scene->footprint, 0);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

// ---- light and camera

static void add_lamp(float light[9][3], const float d[3], const float color[3]) {
  const float y[9] = {0.282095f,
                      0.488603f * d[1],
                      0.488603f * d[2],
                      0.488603f * d[0],
                      1.092548f * d[0] * d[1],
                      1.092548f * d[1] * d[2],
                      0.315392f * (3 * d[2] * d[2] - 1),
                      1.092548f * d[0] * d[2],
                      0.546274f * (d[0] * d[0] - d[1] * d[1])};
  for (int n = 0; n < 9; ++n)
    for (int c = 0; c < 3; ++c) light[n][c] += y[n] * color[c];
}

static void make_camera(float azimuth, float aspect, float eye[3], const float target[3],
                        float matrix[16]) {
  const float elevation = 0.2f, distance = 4.6f, tangent = 0.30f, near = 0.1f, far = 60;
  const float back[3] = {sinf(azimuth) * cosf(elevation), sinf(elevation),
                         cosf(azimuth) * cosf(elevation)};
  const float right[3] = {cosf(azimuth), 0, -sinf(azimuth)};
  const float up[3] = {back[1] * right[2], back[2] * right[0] - back[0] * right[2],
                       -back[1] * right[0]};
  float move[3] = {0, 0, 0};
  for (int i = 0; i < 3; ++i) {
    eye[i] = target[i] + distance * back[i];
    move[0] -= right[i] * eye[i], move[1] -= up[i] * eye[i], move[2] -= back[i] * eye[i];
  }
  for (int i = 0; i < 4; ++i) {  // projection × view, column by column
    const float x = i < 3 ? right[i] : move[0], y = i < 3 ? up[i] : move[1];
    const float z = i < 3 ? back[i] : move[2], w = i < 3 ? 0 : 1;
    matrix[4 * i + 0] = x / (tangent * aspect);
    matrix[4 * i + 1] = y / tangent;
    matrix[4 * i + 2] = -(far + near) / (far - near) * z - 2 * far * near / (far - near) * w;
    matrix[4 * i + 3] = -z;
  }
}

// ---- a picture

typedef struct Programs {
  GLuint character, scene, footprint;
} Programs;

static void set_view(GLuint program, const float matrix[16], const float eye[3], float exposure) {
  glUseProgram(program);
  glUniformMatrix4fv(at(program, "u_matrix"), 1, GL_FALSE, matrix);
  glUniform1f(at(program, "u_exposure"), exposure);
  glUniform3fv(at(program, "u_sky"), 1, kSky);
  glUniform3fv(at(program, "u_eye"), 1, eye);
}

static void set_floor(GLuint program, const Character* c) {
  glUniform1f(at(program, "u_reach"), 3.0f);
  glUniform1f(at(program, "u_floor"), c->clip.bounds_min[1]);
}

static void draw_footprint(const Programs* programs, const Character* c, const Scene* scene,
                           const float sun[3]) {
  glBindFramebuffer(GL_FRAMEBUFFER, scene->framebuffer);
  glViewport(0, 0, kFootprint, kFootprint);
  glClearColor(0, 0, 0, 0);
  glClear(GL_COLOR_BUFFER_BIT);
  glDisable(GL_DEPTH_TEST);
  glUseProgram(programs->footprint);
  glUniform3fv(at(programs->footprint, "u_sun"), 1, sun);
  set_floor(programs->footprint, c);
  draw_meshes(c, programs->footprint, 0);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

static relit_result draw(const Programs* programs, Character* c, const Scene* scene,
                         SDL_Window* window, double time_s) {
  const float turn = 0.9f + 0.5f * (float)time_s;
  const float sun[3] = {0.62f * sinf(turn), 0.7846f, 0.62f * cosf(turn)}, sky[3] = {0, 1, 0};
  float light[9][3] = {{0}};
  add_lamp(light, sun, (const float[3]){4.6f, 3.9f, 2.9f});
  add_lamp(light, sky, (const float[3]){0.9f, 1.3f, 1.9f});
  for (int i = 0; i < 3; ++i) light[0][i] += 0.5f;

  relit_moment moment = {.struct_size = sizeof moment};
  relit_light_map map = {.struct_size = sizeof map};
  float exposure = 1;
  relit_result result = relit_set_light_sh(c->player, &light[0][0], 9);
  if (!result) result = relit_update(c->player, (int64_t)(time_s * 1e9), &moment);
  if (!result && !moment.ready) result = relit_wait(c->player, 10, &moment);
  if (!result) result = relit_light_map_texture(c->player, &map);
  if (!result) result = relit_auto_exposure(c->player, &exposure);
  if (!result) result = pose(c);
  if (result) return result;

  int width = 0, height = 0;
  float matrix[16], eye[3];
  const float target[3] = {0.5f * (c->clip.bounds_min[0] + c->clip.bounds_max[0]),
                           0.46f * (c->clip.bounds_min[1] + c->clip.bounds_max[1]),
                           0.5f * (c->clip.bounds_min[2] + c->clip.bounds_max[2])};
  SDL_GL_GetDrawableSize(window, &width, &height);
  make_camera(0.5f + 0.25f * sinf(0.4f * (float)time_s), (float)width / (float)height, eye, target,
              matrix);
  draw_footprint(programs, c, scene, sun);

  glViewport(0, 0, width, height);
  glClearColor(powf(kSky[0], 1 / 2.2f), powf(kSky[1], 1 / 2.2f), powf(kSky[2], 1 / 2.2f), 1);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_CULL_FACE);
  set_view(programs->scene, matrix, eye, exposure);
  set_floor(programs->scene, c);
  glUniform3fv(at(programs->scene, "u_sh"), 9, &light[0][0]);
  glBindTexture(GL_TEXTURE_2D, scene->footprint);
  attribute(kPosition, scene->buffer, 3, 9 * sizeof(float), 0);
  attribute(kNormal, scene->buffer, 3, 9 * sizeof(float), 3 * sizeof(float));
  attribute(kColor, scene->buffer, 3, 9 * sizeof(float), 6 * sizeof(float));
  glDrawArrays(GL_TRIANGLES, 0, scene->count);

  set_view(programs->character, matrix, eye, exposure);
  glUniform1f(at(programs->character, "u_scale"), map.radiance_scale);
  glUniform1i(at(programs->character, "u_square_root"), map.square_root);
  glUniform1i(at(programs->character, "u_albedo"), 1);
  glBindTexture(GL_TEXTURE_2D, map.texture);
  draw_meshes(c, programs->character, 1);
  glDisable(GL_CULL_FACE);  // relit draws with what it needs, and leaves this off as well
  return RELIT_OK;
}

static void* get_proc_address(void* user, const char* name) {
  (void)user;
  return SDL_GL_GetProcAddress(name);
}

static relit_result play(relit_player* player, SDL_Window* window, long pictures) {
  relit_gl_options gl;
  relit_gl_options_default(&gl, sizeof gl);
  gl.get_proc_address = get_proc_address;
  relit_result result = relit_gl_attach(player, &gl);
  Character character = {.player = player};
  Scene scene = {.count = 0};
  const Programs programs = {build(kCharacterVertex, kCharacterFragment, "a_uv", "a_albedo_uv"),
                             build(kSceneVertex, kSceneFragment, "a_normal", "a_color"),
                             build(kFootprintVertex, kFootprintFragment, "a_uv", "a_albedo_uv")};
  if (!result) result = load_character(&character);
  make_scene(&scene, character.clip.bounds_min[1]);
  const Uint64 start = SDL_GetPerformanceCounter();
  int leave = 0;
  for (long i = 0; !result && !leave && (pictures == 0 || i < pictures); ++i) {
    SDL_Event event;
    while (SDL_PollEvent(&event))
      leave |= event.type == SDL_QUIT ||
               (event.type == SDL_KEYDOWN && event.key.keysym.sym == SDLK_ESCAPE);
    const Uint64 now = SDL_GetPerformanceCounter();
    result = draw(&programs, &character, &scene, window,
                  (double)(now - start) / (double)SDL_GetPerformanceFrequency());
    SDL_GL_SwapWindow(window);
  }
  free(character.positions);
  free(character.meshes);
  return result;
}

int main(int argc, char** argv) {
  if (argc < 2) return fprintf(stderr, "usage: %s FILE.relit [PICTURES]\n", argv[0]), 2;
  if (SDL_Init(SDL_INIT_VIDEO)) return fprintf(stderr, "%s\n", SDL_GetError()), 2;
  SDL_GL_SetAttribute(SDL_GL_CONTEXT_PROFILE_MASK, SDL_GL_CONTEXT_PROFILE_ES);
  SDL_GL_SetAttribute(SDL_GL_CONTEXT_MAJOR_VERSION, 2);
  SDL_GL_SetAttribute(SDL_GL_CONTEXT_MINOR_VERSION, 0);
  SDL_GL_SetAttribute(SDL_GL_DEPTH_SIZE, 24);
  SDL_Window* window = NULL;
  SDL_GLContext context = NULL;
  for (int samples = 4; !context && samples >= 0; samples -= 4) {  // not every driver has many
    SDL_GL_SetAttribute(SDL_GL_MULTISAMPLEBUFFERS, samples > 0);
    SDL_GL_SetAttribute(SDL_GL_MULTISAMPLESAMPLES, samples);
    if (window) SDL_DestroyWindow(window);
    window =
        SDL_CreateWindow("relit in a scene", SDL_WINDOWPOS_CENTERED, SDL_WINDOWPOS_CENTERED, 960,
                         640, SDL_WINDOW_OPENGL | SDL_WINDOW_RESIZABLE | SDL_WINDOW_ALLOW_HIGHDPI);
    if (window) context = SDL_GL_CreateContext(window);
  }
  if (!context) return fprintf(stderr, "%s\n", SDL_GetError()), 2;
  SDL_GL_SetSwapInterval(1);
  relit_player* player = NULL;
  relit_result result = relit_open(argv[1], NULL, &player);
  if (!result) result = play(player, window, argc > 2 ? atol(argv[2]) : 0);
  if (result) fprintf(stderr, "%s: %s\n", relit_result_name(result), relit_last_error(player));
  relit_close(player);
  SDL_GL_DeleteContext(context);
  SDL_DestroyWindow(window);
  SDL_Quit();
  return result ? 1 : 0;
}
