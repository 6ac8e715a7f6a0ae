// Two light maps, each with its share.
VARYING vec2 v_uv_a;
VARYING vec2 v_uv_b;
uniform sampler2D u_map_a;
uniform sampler2D u_map_b;
uniform vec4 u_size_a, u_size_b;  // size, 1 / size
uniform vec2 u_share;

vec3 bilinear(sampler2D map, vec2 uv, vec4 size) {
  vec2 p = uv * size.xy - 0.5;
  vec2 corner = floor(p);
  vec2 f = p - corner;
  vec2 low = (corner + 0.5) * size.zw;
  vec2 high = low + size.zw;
  return mix(mix(SAMPLE_2D(map, low).rgb, SAMPLE_2D(map, vec2(high.x, low.y)).rgb, f.x),
             mix(SAMPLE_2D(map, vec2(low.x, high.y)).rgb, SAMPLE_2D(map, high).rgb, f.x), f.y);
}

void main() {
#ifdef MANUAL_A
  vec3 a = bilinear(u_map_a, v_uv_a, u_size_a);
#else
  vec3 a = SAMPLE_2D(u_map_a, v_uv_a).rgb;
#endif
#ifdef MANUAL_B
  vec3 b = bilinear(u_map_b, v_uv_b, u_size_b);
#else
  vec3 b = SAMPLE_2D(u_map_b, v_uv_b).rgb;
#endif
#ifdef ROOT_A
  a *= a;
#endif
#ifdef ROOT_B
  b *= b;
#endif
  vec3 sum = u_share.x * a + u_share.y * b;
#ifdef SQUARE_ROOT
  vec3 root = sqrt(clamp(sum, 0.0, 1.0));
  FRAG_COLOR = vec4(root + dither(gl_FragCoord.xy) * (1.0 / 255.0), 1.0);
#else
  FRAG_COLOR = vec4(sum, 1.0);
#endif
}
