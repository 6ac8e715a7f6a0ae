ATTRIBUTE vec2 a_position;  // pixels from the upper left corner
ATTRIBUTE vec2 a_texel;
ATTRIBUTE vec4 a_color;
uniform vec2 u_to_clip;
uniform vec2 u_to_atlas;
VARYING vec2 v_uv;
VARYING vec4 v_color;

void main() {
  v_uv = a_texel * u_to_atlas;
  v_color = a_color;
  gl_Position = vec4(a_position * u_to_clip + vec2(-1.0, 1.0), 0.0, 1.0);
}
