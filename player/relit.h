// SPDX-License-Identifier: MIT
#ifndef RELIT_H
#define RELIT_H

#include <stddef.h>
#include <stdint.h>

/// relit plays relightable animation inside somebody else's program: C99, C++ from 11 on.
///
/// Tiers. A *pool* has threads and is shared by players. A *player* has a file, a clock, a light
/// and a light map; it needs no GL ("headless": relit_light_map_pixels(), relit_posed_vertices()).
/// While a GL context is *attached* it also draws, or gives its light map as a texture.
///
///     relit_open -> relit_gl_attach -> { relit_update, relit_draw }... -> relit_gl_detach ->
///     relit_close
///
/// Results. Every function that can fail returns a relit_result, 0 for success, and then changes
/// nothing unless its comment says so. relit_last_error() has the reason in words. No exception and
/// no signal crosses this border; running out of memory is a result like any other.
///
/// Threads. A player belongs to one thread: the one that opened it, until relit_gl_attach() or
/// relit_adopt() is called on another, which the host orders after everything the first did.
/// Calls from any other thread return RELIT_INVALID and do nothing; only relit_cancel() may come
/// from anywhere. Different players are independent. Callbacks say where they are called from.
///
/// Structs. Each begins with struct_size, the host's sizeof: fill options by their _default()
/// function, set struct_size of results yourself. Smaller than in version 0.1: RELIT_INVALID.
/// Larger than this library knows: options must be zero there (else RELIT_UNSUPPORTED), results
/// become zero.
///
/// Units. Seconds, metres, radians, bytes, linear radiance. Space: right-handed, +Y up, as in the
/// file ("model space"). Matrices are column-major. Booleans are 0 or 1. Strings are UTF-8.
///
/// GL state. The library links no GL: all goes through get_proc_address. relit_gl_attach(),
/// relit_gl_detach(), relit_update(), relit_wait(), relit_draw() and the two light maps need the
/// attached context current. They set all state that they need, whatever the host left, and leave:
/// framebuffer bindings, viewport and scissor box as they were; no program, renderbuffer, buffer or
/// vertex array bound, no attribute array enabled (ES 3: those of vertex array 0 as they were), and
/// attribute 3 at (1, 1, 1, 1); of the texture units used, at most 16 from 0, no 2D or cube texture
/// nor sampler bound, and unit 0 active; no pixel pack or unpack buffer bound; blending, depth,
/// cull, scissor and stencil test, polygon offset, sample coverage, alpha to coverage, sample mask
/// and rasterizer discard off, dithering on; all masks on; blend equation and function, depth
/// function and range, cull and front face, clear colour and depth, and pixel store at GL's
/// defaults. Everything else is not touched. No transform feedback may be active.

#define RELIT_VERSION_MAJOR 0
#define RELIT_VERSION_MINOR 1
#define RELIT_VERSION_PATCH 0

#if defined(__GNUC__)
#define RELIT_API __attribute__((visibility("default")))
#else
#define RELIT_API
#endif
#if defined(__cplusplus)
#define RELIT_NOEXCEPT noexcept
extern "C" {
#else
#define RELIT_NOEXCEPT
#endif

/// What a call returns. The numbers never change; later versions may add some.
typedef enum relit_result {
  RELIT_OK = 0,
  RELIT_IO = 1,             ///< reading failed: missing file, lost connection
  RELIT_TRUNCATED = 2,      ///< the data end before they should
  RELIT_CORRUPT = 3,        ///< the data contradict themselves or their checksum
  RELIT_UNSUPPORTED = 4,    ///< well formed, but needs something this build does not have
  RELIT_LIMIT = 5,          ///< a size or count beyond what a file may have
  RELIT_INVALID = 6,        ///< an argument that makes no sense, the wrong thread, the wrong state
  RELIT_NOT_FOUND = 7,      ///< a name, frame, clip or mesh that is not there, or not yet
  RELIT_OUT_OF_MEMORY = 8,  ///< an allocation failed, or the budget does not suffice
  RELIT_ENVIRONMENT = 9,    ///< no current GL context, or one that cannot do it
  RELIT_CANCELLED = 10      ///< relit_cancel(), or an interrupt callback, or a wait that timed out
} relit_result;

typedef struct relit_pool relit_pool;
typedef struct relit_player relit_player;

/// The version of the library: major << 16 | minor << 8 | patch. Any thread.
RELIT_API uint32_t relit_version(void) RELIT_NOEXCEPT;
/// The same as "0.1.0". Static. Any thread.
RELIT_API const char* relit_version_text(void) RELIT_NOEXCEPT;
/// A result's name, such as "RELIT_IO"; "?" for other numbers. Static. Any thread.
RELIT_API const char* relit_result_name(relit_result result) RELIT_NOEXCEPT;

// ---- memory and messages

/// Where a player's handle and its pictures come from: everything that decoders hold and that is
/// decoded ahead, which is most of what a player takes. The file's static records, the light map
/// that the processor composites, vertices and small bookkeeping come from the C++ runtime; FFmpeg,
/// zstd and the GL driver have allocators of their own. Called from any thread, several at once.
/// Must not call the player. Its functions stay callable until relit_close() has returned.
typedef struct relit_allocator {
  void* user;
  /// `bytes` > 0; `alignment` is a power of two, 64 at most. NULL: out of memory.
  void* (*allocate)(void* user, size_t bytes, size_t alignment);
  /// `bytes` is what was asked for.
  void (*release)(void* user, void* memory, size_t bytes);
} relit_allocator;

typedef enum relit_log_level {
  RELIT_LOG_ERROR = 0,
  RELIT_LOG_WARNING = 1,
  RELIT_LOG_INFO = 2
} relit_log_level;

/// Takes one sentence without a newline, valid during the call. Called from any thread, one call of
/// a player at a time. Must not call the player.
typedef void (*relit_log)(void* user, relit_log_level level, const char* text);

// ---- pools

typedef struct relit_pool_options {
  size_t struct_size;
  int32_t threads;  ///< 0 (the default): as many as the machine has processors; at most 64
} relit_pool_options;

RELIT_API relit_result relit_pool_options_default(relit_pool_options* options,
                                                  size_t struct_size) RELIT_NOEXCEPT;

/// Makes a pool of threads that decode. Players that share one take turns fairly. Returns
/// RELIT_INVALID, RELIT_OUT_OF_MEMORY, RELIT_ENVIRONMENT (no more threads); *pool is then NULL.
/// `options` may be NULL. The host releases the pool once; players that use it keep it alive. Any
/// thread.
RELIT_API relit_result relit_pool_create(const relit_pool_options* options,
                                         relit_pool** pool) RELIT_NOEXCEPT;
/// Gives up the host's hold on a pool. NULL is allowed. Any thread.
RELIT_API void relit_pool_release(relit_pool* pool) RELIT_NOEXCEPT;

// ---- opening

/// Who adds planes up under the light.
typedef enum relit_path {
  RELIT_PATH_AUTO = 0,     ///< whichever measures cheapest, again when the size changes
  RELIT_PATH_CPU = 1,      ///< the processor, and one small texture goes up
  RELIT_PATH_TEXTURE = 2,  ///< the GPU, into the light map
  RELIT_PATH_FUSED = 3     ///< the GPU, in the shader that draws the meshes; has no light map
} relit_path;

typedef struct relit_open_options {
  size_t struct_size;
  relit_pool* pool;  ///< NULL (default): one of its own
  const char* clip;  ///< by name, or by its number from 0; NULL (default): the first
  int32_t model;     ///< among the clip's appearance models; 0, as files of this version have one
  int32_t layers;    ///< only the first so many, faster and less accurate; -1 (default): all
  int32_t threads;   ///< of the pool of its own; 0 (default): one a processor
  int32_t interpolate;  ///< 1 (default): light maps and poses are blended between frames
  int32_t path;         ///< relit_path; default RELIT_PATH_AUTO
  /// 0 (default): no bound. What cannot fit is refused with RELIT_OUT_OF_MEMORY, and the least
  /// budget that would do is said. Sequences and cross-fades, of which two clips are in memory at
  /// once, are planned when they are asked for: frames ahead, threads and layers may become fewer.
  uint64_t memory_budget_bytes;
  double target_fps;    ///< display rate that the governor defends; 0 (default): 60
  double quality;       ///< 0..1: fixed; negative (default): the governor chooses
  const char* decoder;  ///< an FFmpeg decoder by name, such as "h264_v4l2m2m", for the codecs it
                        ///< fits; where it does not open, software does, with a warning
  const char* const* http_headers;  ///< "Name: value", ended by NULL; or NULL (default)
  double timeout_s;                 ///< without a byte from a server; default 10
  relit_log log;                    ///< NULL (default): nothing is said
  void* log_user;
  const relit_allocator* allocator;  ///< copied; NULL (default): the runtime's
  /// Polled while waiting for bytes, from the thread that waits: nonzero cancels. May be NULL.
  int (*interrupt)(void* user);
  void* interrupt_user;
} relit_open_options;

RELIT_API relit_result relit_open_options_default(relit_open_options* options,
                                                  size_t struct_size) RELIT_NOEXCEPT;

/// Opens a path, "-" (standard input) or an http(s) address: reads everything before the first
/// frame and begins to decode. `options` may be NULL and can go when this returns. Returns what
/// reading gives, RELIT_NOT_FOUND for a clip that is not there, RELIT_OUT_OF_MEMORY for a budget
/// that cannot do. Whatever the result, *player is set: to a player that has failed and only knows
/// relit_last_error() and relit_close(), or to NULL where there was not enough memory even for
/// that. The host closes it. Any thread, which then owns the player.
RELIT_API relit_result relit_open(const char* source, const relit_open_options* options,
                                  relit_player** player) RELIT_NOEXCEPT;

/// The same of a file in memory, which stays there unchanged until relit_close().
RELIT_API relit_result relit_open_memory(const void* bytes, size_t size,
                                         const relit_open_options* options,
                                         relit_player** player) RELIT_NOEXCEPT;

/// A source that the host implements. Called from threads of the player, never two at once; must
/// not call the player.
typedef struct relit_source {
  size_t struct_size;
  void* user;
  /// Writes 1 to `bytes` (> 0) bytes to `out` and returns how many; 0 at the end; on failure a
  /// relit_result negated. Required.
  int64_t (*read)(void* user, uint8_t* out, size_t bytes);
  /// Makes `offset` the current position and returns 0, or a relit_result negated. NULL: the source
  /// only goes forward; it then cannot loop, seek back or cross-fade.
  int (*seek)(void* user, uint64_t offset);
  /// Bytes in all; negative, or NULL: unknown.
  int64_t (*size)(void* user);
  /// Hint: [begin, end) will be read next, and what lies behind may never be. May be NULL.
  void (*expect)(void* user, uint64_t begin, uint64_t end);
  /// Called once, when the player is done with the source, also where opening fails. May be NULL.
  void (*close)(void* user);
} relit_source;

/// The same of a host's callbacks. `source` is copied.
RELIT_API relit_result relit_open_callbacks(const relit_source* source,
                                            const relit_open_options* options,
                                            relit_player** player) RELIT_NOEXCEPT;

/// Closes a player in whatever state, NULL included; everything it lent is gone. Where a context is
/// attached it must be current, or relit_gl_abandon() have been called. May wait for a read of the
/// source to come back.
RELIT_API void relit_close(relit_player* player) RELIT_NOEXCEPT;

/// Why the last call on this player that failed did so, in words; "" where none has. Valid until
/// the next call on it. Asked from another thread than the player's, it says that. NULL gives "".
RELIT_API const char* relit_last_error(const relit_player* player) RELIT_NOEXCEPT;

/// Makes reads and waits in progress end with RELIT_CANCELLED, for good: only relit_close() is left
/// to do. Any thread, while the player is open.
RELIT_API relit_result relit_cancel(relit_player* player) RELIT_NOEXCEPT;

/// Makes the calling thread the player's. No context may be attached.
RELIT_API relit_result relit_adopt(relit_player* player) RELIT_NOEXCEPT;

// ---- what is in the file

typedef struct relit_clip_info {
  size_t struct_size;
  const char* name;  ///< lent until relit_close()
  uint64_t frame_count;
  double duration_s;
  int32_t loops;        ///< the file says that its end meets its beginning
  int32_t light_order;  ///< spherical harmonics' bands beyond the constant that it answers to, 0..3
  int32_t width, height;  ///< of the light map, texels
  int32_t layer_count;
  float bounds_min[3], bounds_max[3];  ///< of all frames, metres
} relit_clip_info;

RELIT_API uint32_t relit_clip_count(const relit_player* player) RELIT_NOEXCEPT;
/// RELIT_NOT_FOUND for a clip >= relit_clip_count().
RELIT_API relit_result relit_clip(relit_player* player, uint32_t clip,
                                  relit_clip_info* info) RELIT_NOEXCEPT;

/// What all frames of a mesh share. Pointers are lent until relit_close().
typedef struct relit_mesh_info {
  size_t struct_size;
  const char* name;
  uint32_t vertex_count;     ///< 1 to 65 535
  uint32_t index_count;      ///< a multiple of 3
  const uint16_t* indices;   ///< triangles, counter-clockwise from the front
  const float* lightmap_uv;  ///< [vertex_count][2] in [0,1]; v = 0 is the light map's first row
  const float* albedo_uv;    ///< likewise; NULL: the same as lightmap_uv
  const uint8_t* colors;     ///< [vertex_count][4] linear, straight alpha; NULL: white
  uint32_t material;
} relit_mesh_info;

RELIT_API uint32_t relit_mesh_count(const relit_player* player) RELIT_NOEXCEPT;
RELIT_API relit_result relit_mesh(relit_player* player, uint32_t mesh,
                                  relit_mesh_info* info) RELIT_NOEXCEPT;

/// Albedo = decode_srgb(image) × base_color × vertex colour.
typedef struct relit_material_info {
  size_t struct_size;
  const char* name;
  float base_color[4];     ///< linear, straight alpha
  int32_t image;           ///< -1: none
  int32_t wrap_u, wrap_v;  ///< 0 repeat, 1 clamp, 2 mirror
  int32_t linear_filter;   ///< 0: the nearest texel
  int32_t alpha_mode;      ///< 0 opaque, 1 mask, 2 blend
  float alpha_cutoff;      ///< of a mask
} relit_material_info;

RELIT_API uint32_t relit_material_count(const relit_player* player) RELIT_NOEXCEPT;
RELIT_API relit_result relit_material(relit_player* player, uint32_t material,
                                      relit_material_info* info) RELIT_NOEXCEPT;

RELIT_API uint32_t relit_image_count(const relit_player* player) RELIT_NOEXCEPT;
/// Decodes an albedo image: sRGB, straight alpha, [height][width][4], first row on top. With `rgba`
/// NULL only the size is given. `bytes` is the room at `rgba`; RELIT_INVALID where it is not width
/// × height × 4. Errors of the picture: RELIT_CORRUPT, RELIT_TRUNCATED, RELIT_UNSUPPORTED.
RELIT_API relit_result relit_image(relit_player* player, uint32_t image, int32_t* width,
                                   int32_t* height, uint8_t* rgba, size_t bytes) RELIT_NOEXCEPT;

// ---- light: in model space, far away. At open it is white, radiance 1 from everywhere.

/// Spherical harmonics: real, orthonormal, no Condon-Shortley sign, n = l² + l + m, band 1 is
/// 0.488603·(y, z, x). `rgb` is [count][3] radiance, count = 1, 4, 9 or 16. RELIT_INVALID for
/// another count or a number that is not finite; any finite light works, 1e30 too.
RELIT_API relit_result relit_set_light_sh(relit_player* player, const float* rgb,
                                          uint32_t count) RELIT_NOEXCEPT;

/// An equirectangular picture, [height][width][3] radiance; row 0 is +Y, pixel (x, y) is the
/// direction (sin θ cos φ, cos θ, sin θ sin φ), θ = π(y+½)/height, φ = 2π(x+½)/width. Copied (for
/// the background). RELIT_INVALID for radiance that is negative or not finite, RELIT_LIMIT for
/// sides beyond 16384.
RELIT_API relit_result relit_set_environment(relit_player* player, const float* rgb, int32_t width,
                                             int32_t height) RELIT_NOEXCEPT;

/// A light file: .hdr or .exr (equirectangular), or .json: spherical harmonics, keys over time, or
/// a grid of probes in space. Errors of the file: RELIT_IO, RELIT_TRUNCATED, RELIT_CORRUPT,
/// RELIT_UNSUPPORTED, RELIT_LIMIT, RELIT_INVALID.
RELIT_API relit_result relit_set_light_file(relit_player* player, const char* path) RELIT_NOEXCEPT;

/// Turns whichever light is set about +Y: `angle_rad` is added to φ. RELIT_INVALID where not
/// finite.
RELIT_API relit_result relit_turn_light(relit_player* player, double angle_rad) RELIT_NOEXCEPT;

/// Where the character stands among the probes of a light file, metres. Default: the origin.
RELIT_API relit_result relit_set_position(relit_player* player,
                                          const float position[3]) RELIT_NOEXCEPT;

/// The exposure under which a white surface in the mean of the present light is a little below
/// white.
RELIT_API relit_result relit_auto_exposure(relit_player* player, float* exposure) RELIT_NOEXCEPT;

// ---- time

typedef enum relit_loop {
  RELIT_LOOP_AS_FILE = 0,  ///< the default: as relit_clip_info::loops says
  RELIT_LOOP_OFF = 1,
  RELIT_LOOP_ON = 2
} relit_loop;

/// One entry of a sequence.
typedef struct relit_sequence_entry {
  uint32_t clip;
  uint32_t repeats;     ///< times that it is played, at least 1
  double cross_fade_s;  ///< over which it blends in from the entry before; 0: a cut
} relit_sequence_entry;

/// Plays one clip, from its beginning at the next relit_update(). With cross_fade_s > 0 light maps
/// and poses blend over from what is playing (where the source cannot seek, it is a cut).
/// RELIT_NOT_FOUND for a clip that is not there; RELIT_UNSUPPORTED for another one where the source
/// cannot seek; RELIT_INVALID for a fade that is negative or not finite; RELIT_OUT_OF_MEMORY where
/// the budget does not suffice for both clips. What played goes on then.
RELIT_API relit_result relit_play_clip(relit_player* player, uint32_t clip,
                                       double cross_fade_s) RELIT_NOEXCEPT;
/// Plays clips one after the other, `loop` (0 or 1) from the first again. `entries` is copied.
/// Errors: as relit_play_clip().
RELIT_API relit_result relit_play_sequence(relit_player* player,
                                           const relit_sequence_entry* entries, size_t count,
                                           int32_t loop) RELIT_NOEXCEPT;

RELIT_API relit_result relit_set_paused(relit_player* player, int32_t paused) RELIT_NOEXCEPT;
/// 1 is real time, 0 stands still, below 0 goes backwards, where the source can seek. RELIT_INVALID
/// where it is not finite or beyond ±100.
RELIT_API relit_result relit_set_speed(relit_player* player, double speed) RELIT_NOEXCEPT;
RELIT_API relit_result relit_set_loop(relit_player* player, relit_loop loop) RELIT_NOEXCEPT;
/// To a time of the clip or sequence. Before the start counts as the start, beyond the end as the
/// last frame (of what loops: as the remainder). RELIT_INVALID where not finite. What was being
/// decoded is dropped; the last picture stays until the new one is here. Where a source cannot go
/// back, relit_update() then says RELIT_NOT_FOUND.
RELIT_API relit_result relit_seek(relit_player* player, double time_s) RELIT_NOEXCEPT;
/// To the start of a frame of the clip that is playing; a sequence becomes that one clip. Beyond
/// the end: the last frame. RELIT_NOT_FOUND where frames are of unequal length, and that one has
/// not come near yet.
RELIT_API relit_result relit_seek_frame(relit_player* player, uint64_t frame) RELIT_NOEXCEPT;
/// Pauses, and goes so many frames on or back, around the ends of what loops.
RELIT_API relit_result relit_step(relit_player* player, int32_t frames) RELIT_NOEXCEPT;

/// What a display frame shows.
typedef struct relit_moment {
  size_t struct_size;
  int32_t ready;    ///< a picture has arrived since the player was opened
  int32_t changed;  ///< it differs from the last one: there is something to draw
  int32_t late;     ///< what time asks for is not here yet, and the last picture stays
  int32_t ended;    ///< the end has been reached, and nothing loops
  uint32_t clip;
  uint64_t frame;  ///< of the clip, the earlier one of two that are blended
  double time_s;   ///< in the clip or sequence
  double next_s;   ///< until the picture changes by itself; infinite: not before a call
} relit_moment;

/// Once a display frame: moves the clock to `now_ns`, a monotonic time of the host's choosing,
/// takes the frames that are there, lets the governor decide, and composites if frame, light or
/// quality changed. Does not wait for frames: one that is not here is late, as is one of unequal
/// length of which it is not known yet when it is shown; the last picture stays, and what stays
/// late for a quarter of a second makes the clock stand until it comes. A frame that damage hit is
/// not late: the last picture stays for it, too. The clock starts with the first call
/// at which a picture is ready; a time that runs backwards counts as no time. `moment` may be NULL.
/// Returns errors of the source, each once; playback then stands on the last picture.
RELIT_API relit_result relit_update(relit_player* player, int64_t now_ns,
                                    relit_moment* moment) RELIT_NOEXCEPT;

/// Waits until the frame that the last relit_update(), seek or step asked for is decoded, and shows
/// it; the clock does not move. RELIT_CANCELLED after timeout_s (finite, >= 0).
RELIT_API relit_result relit_wait(relit_player* player, double timeout_s,
                                  relit_moment* moment) RELIT_NOEXCEPT;

// ---- what may be traded

RELIT_API relit_result relit_set_layers(relit_player* player, int32_t layers) RELIT_NOEXCEPT;
RELIT_API relit_result relit_set_interpolation(relit_player* player, int32_t on) RELIT_NOEXCEPT;
RELIT_API relit_result relit_set_path(relit_player* player, relit_path path) RELIT_NOEXCEPT;
/// As in relit_open_options. RELIT_INVALID beyond 1 or not a number.
RELIT_API relit_result relit_set_quality(relit_player* player, double quality) RELIT_NOEXCEPT;
/// 1 to 1000; 0: 60.
RELIT_API relit_result relit_set_target_fps(relit_player* player, double fps) RELIT_NOEXCEPT;

// ---- GL

/// Finds an entry point of the current context by name, as eglGetProcAddress does.
typedef void* (*relit_get_proc_address)(void* user, const char* name);

typedef struct relit_gl_options {
  size_t struct_size;
  relit_get_proc_address get_proc_address;  ///< required
  void* user;
  int32_t es_version;              ///< 0 (default): the best the context offers; 2 or 3
  const char* ignored_extensions;  ///< names separated by blanks, treated as absent; or NULL
} relit_gl_options;

RELIT_API relit_result relit_gl_options_default(relit_gl_options* options,
                                                size_t struct_size) RELIT_NOEXCEPT;

/// Takes the context that is current: OpenGL ES 2.0 or later, or OpenGL 3.3 core with ES shaders.
/// Uploads meshes and albedo. The calling thread becomes the player's. RELIT_ENVIRONMENT where no
/// context is current or it cannot do; RELIT_INVALID where one is attached already. Players share
/// no GL objects.
RELIT_API relit_result relit_gl_attach(relit_player* player,
                                       const relit_gl_options* options) RELIT_NOEXCEPT;
/// Deletes the player's objects of the context, which is current. Playback goes on headless.
/// Without a context it does nothing.
RELIT_API relit_result relit_gl_detach(relit_player* player) RELIT_NOEXCEPT;
/// The context is lost or gone: forgets the objects without calling GL. Attach another one then.
RELIT_API relit_result relit_gl_abandon(relit_player* player) RELIT_NOEXCEPT;

/// From exposed radiance to display values, before the sRGB curve.
typedef enum relit_tone_map {
  RELIT_TONE_MAP_LINEAR = 0,  ///< clamped at 1
  RELIT_TONE_MAP_FILMIC = 1,  ///< Narkowicz's fit to ACES
  RELIT_TONE_MAP_NEUTRAL = 2  ///< Khronos PBR Neutral: the default
} relit_tone_map;

typedef enum relit_background {
  RELIT_BACKGROUND_KEEP = 0,         ///< the host's colour and depth stay: the default
  RELIT_BACKGROUND_TRANSPARENT = 1,  ///< alpha 0 (the picture is premultiplied), depth 1
  RELIT_BACKGROUND_COLOR = 2,        ///< background_color, depth 1
  RELIT_BACKGROUND_LIGHT = 3         ///< the environment where there is one, else the harmonics
} relit_background;

typedef struct relit_view {
  size_t struct_size;
  float view[16];        ///< model space to camera space, looking along -z; default: the identity
  float projection[16];  ///< to clip space with -w <= z <= w
  float exposure;      ///< display value = tone map(radiance × exposure); finite, >= 0; default 1
  int32_t tone_map;    ///< relit_tone_map
  int32_t background;  ///< relit_background
  float background_color[3];    ///< sRGB display values 0..1
  float background_blur_rad;    ///< of the environment, standard deviation
  int32_t x, y, width, height;  ///< in the framebuffer, pixels, y up; width and height >= 1
} relit_view;

RELIT_API relit_result relit_view_default(relit_view* view, size_t struct_size) RELIT_NOEXCEPT;

/// Draws the character into the framebuffer that is bound, which has a depth buffer, sRGB-encoded
/// (the framebuffer's own conversion off). Before the first picture only the background. Front
/// faces are counter-clockwise. RELIT_INVALID for a view that is not finite, without a context, or
/// where exposure × light overflows a float; RELIT_ENVIRONMENT where no context is current, or from
/// GL.
RELIT_API relit_result relit_draw(relit_player* player, const relit_view* view) RELIT_NOEXCEPT;

/// The light map as a texture, for shaders of the host's own:
///
///     vec3 light = texture2D(map, lightmap_uv).rgb;
///     if (square_root) light *= light;
///     radiance = max(light, 0.0) * radiance_scale * albedo;
typedef struct relit_light_map {
  size_t struct_size;
  uint32_t texture;  ///< RGBA, row 0 is v = 0, clamped at the edges; lent, not to be changed
  int32_t width, height;
  int32_t square_root;    ///< texels are square roots
  int32_t linear_filter;  ///< 0: the format cannot be filtered here, take four texels
  float radiance_scale;
} relit_light_map;

/// Valid until the next relit_update(), relit_wait() or relit_gl_detach(). With RELIT_PATH_FUSED,
/// composites it besides. RELIT_NOT_FOUND before the first picture; RELIT_INVALID without a
/// context.
RELIT_API relit_result relit_light_map_texture(relit_player* player,
                                               relit_light_map* map) RELIT_NOEXCEPT;

/// Of the light map, texels: as relit_clip_info says, or half of it where the governor gave that
/// up.
RELIT_API relit_result relit_light_map_size(relit_player* player, int32_t* width,
                                            int32_t* height) RELIT_NOEXCEPT;
/// The light map as numbers: [3][height][width] radiance for albedo 1, negative where the light
/// rings. `count` is 3 × height × width, else RELIT_INVALID. Headless, or by reading the texture
/// back. RELIT_NOT_FOUND before the first picture.
RELIT_API relit_result relit_light_map_pixels(relit_player* player, float* out,
                                              size_t count) RELIT_NOEXCEPT;

/// The vertices of a mesh at the moment of the light map, model space: positions, and unit normals
/// unless NULL, [vertex_count][3] each. `count` is the mesh's vertex_count, else RELIT_INVALID.
/// Needs no context. RELIT_NOT_FOUND before the first picture.
RELIT_API relit_result relit_posed_vertices(relit_player* player, uint32_t mesh, float* positions,
                                            float* normals, size_t count) RELIT_NOEXCEPT;

// ---- how it goes

typedef struct relit_statistics {
  size_t struct_size;
  // Display frames, since relit_open(): updates = shown + repeated + late + waiting.
  uint64_t updates;
  uint64_t shown;           ///< with a new picture
  uint64_t repeated;        ///< where nothing had to change
  uint64_t late;            ///< that kept an older picture, as the frame was not here
  uint64_t waiting;         ///< before the first picture
  uint64_t skipped_frames;  ///< of the clip, that were due but never shown
  uint64_t composites;
  // Damage.
  uint64_t lost_frames, lost_records, lost_segments;
  // Milliseconds, means in which the latest count most (decode_ms: of all); 0 where it did not
  // happen.
  double decode_ms;     ///< a frame, all layers, summed over threads
  double composite_ms;  ///< a composite, the upload included
  double draw_ms;       ///< relit_draw(), as far as the processor takes part
  // Bytes.
  uint64_t read_bytes;  ///< of the source
  uint64_t ring_bytes, ring_peak_bytes, ring_limit_bytes;
  uint32_t ring_frames;
  uint64_t planned_bytes;  ///< the memory plan's account
  uint64_t gpu_bytes;
  // What the governor and the path decided.
  double quality;           ///< 0..1
  int32_t path;             ///< relit_path that runs; RELIT_PATH_AUTO: none yet
  int32_t planes;           ///< composited
  int32_t planes_of;        ///< how many the model has
  int32_t half_size;        ///< the light map is composited at half its size
  int32_t light_map_every;  ///< nth display frame
  int32_t threads;
  uint64_t pose_bytes;  ///< decoded poses of the segment that is played
} relit_statistics;

RELIT_API relit_result relit_get_statistics(relit_player* player,
                                            relit_statistics* statistics) RELIT_NOEXCEPT;

/// The memory plan, a line a term, as `relit plan` prints it. Lent until the next call.
RELIT_API const char* relit_memory_plan(relit_player* player) RELIT_NOEXCEPT;

#if defined(__cplusplus)
}
#endif

#endif  // RELIT_H
