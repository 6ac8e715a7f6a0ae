ATTRIBUTE vec3 a_position;
ATTRIBUTE vec2 a_light_map_uv;
ATTRIBUTE vec2 a_albedo_uv;
ATTRIBUTE vec4 a_color;
uniform mat4 u_view_projection;
uniform vec4 u_light_map_place;  // scale and offset of the light map's coordinates
VARYING vec2 v_light_map_uv;
VARYING vec2 v_albedo_uv;
VARYING vec4 v_color;

void main() {
  v_light_map_uv = a_light_map_uv * u_light_map_place.xy + u_light_map_place.zw;
  v_albedo_uv = a_albedo_uv;
  v_color = a_color;
  gl_Position = u_view_projection * vec4(a_position, 1.0);
}
