// The composite where a fragment looks at the light map: the four texels around it, each summed as in
// texture space, then filtered. Clamping the place by half a texel clamps at the edges, and keeps the
// filter off the tile's neighbours in the sheet.
uniform vec2 u_map_size;

vec3 fused_light(vec2 uv) {
  vec2 p = clamp(uv * u_map_size, vec2(0.5), u_map_size - 0.5) - 0.5;
  vec2 corner = floor(p);
  vec2 f = p - corner;
  vec2 high = min(corner + 1.5, u_map_size - 0.5);
  tap_at = vec4(corner + 0.5, high);
  vec2 g = 1.0 - f;
  tap_share = vec4(g.x * g.y, f.x * g.y, g.x * f.y, f.x * f.y);
  return plane_sum();
}
