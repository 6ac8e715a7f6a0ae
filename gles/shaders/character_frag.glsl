VARYING vec2 v_light_map_uv;
VARYING vec2 v_albedo_uv;
VARYING vec4 v_color;
#ifndef FUSED
uniform sampler2D u_light_map;
#endif
uniform vec4 u_base_color;
uniform float u_light_scale;  // from the texture's values to exposed radiance
#ifdef MANUAL_BILINEAR
uniform vec4 u_light_map_size;  // size, 1 / size
#endif
#ifdef ALBEDO_TEXTURE
uniform sampler2D u_albedo;
#endif
#ifdef ALPHA_MASK
uniform float u_alpha_cutoff;
#endif

vec3 light() {
#ifdef FUSED
  vec3 value = fused_light(v_light_map_uv);
#elif defined(MANUAL_BILINEAR)
  vec2 p = v_light_map_uv * u_light_map_size.xy - 0.5;
  vec2 corner = floor(p);
  vec2 f = p - corner;
  vec2 low = (corner + 0.5) * u_light_map_size.zw;
  vec2 high = low + u_light_map_size.zw;
  vec3 value = mix(mix(SAMPLE_2D(u_light_map, low).rgb,
                       SAMPLE_2D(u_light_map, vec2(high.x, low.y)).rgb, f.x),
                   mix(SAMPLE_2D(u_light_map, vec2(low.x, high.y)).rgb,
                       SAMPLE_2D(u_light_map, high).rgb, f.x), f.y);
#else
  vec3 value = SAMPLE_2D(u_light_map, v_light_map_uv).rgb;
#endif
#ifdef SQUARE_ROOT
  value *= value;
#endif
  return max(value, vec3(0.0));
}

#ifdef ALBEDO_TEXTURE
#ifdef WRAP_IN_SHADER
// For ES 2 without repeat for this size: 0 clamps, 1 repeats, 2 mirrors.
uniform vec2 u_wrap;
float wrapped(float x, float mode) {
  if (mode > 1.5) return 1.0 - abs(2.0 * fract(x * 0.5) - 1.0);
  if (mode > 0.5) return fract(x);
  return x;
}
#define ALBEDO_UV vec2(wrapped(v_albedo_uv.x, u_wrap.x), wrapped(v_albedo_uv.y, u_wrap.y))
#else
#define ALBEDO_UV v_albedo_uv
#endif
#endif

void main() {
  vec4 albedo = u_base_color * v_color;
#ifdef ALBEDO_TEXTURE
  vec4 texel = SAMPLE_2D(u_albedo, ALBEDO_UV);
#ifdef DECODE_ALBEDO
  texel.rgb = decode_srgb(texel.rgb);
#endif
  albedo *= texel;
#endif
#ifdef ALPHA_MASK
  if (albedo.a < u_alpha_cutoff) discard;
#endif
#ifndef ALPHA_BLEND
  albedo.a = 1.0;
#endif
  FRAG_COLOR = vec4(display(light() * u_light_scale * albedo.rgb, gl_FragCoord.xy), albedo.a);
}
