ATTRIBUTE vec2 a_position;
uniform vec4 u_place_a, u_place_b;  // scale and offset of coordinates
VARYING vec2 v_uv_a;
VARYING vec2 v_uv_b;

void main() {
  vec2 uv = a_position * 0.5 + 0.5;
  v_uv_a = uv * u_place_a.xy + u_place_a.zw;
  v_uv_b = uv * u_place_b.xy + u_place_b.zw;
  gl_Position = vec4(a_position, 0.0, 1.0);
}
