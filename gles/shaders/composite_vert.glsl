ATTRIBUTE vec2 a_position;
uniform vec4 u_texels;  // scale and offset from [0,1] to the planes' texels
VARYING vec2 v_texel;

void main() {
  v_texel = (a_position * 0.5 + 0.5) * u_texels.xy + u_texels.zw;
  gl_Position = vec4(a_position, 0.0, 1.0);
#ifdef FLAT_WEIGHTS
  copy_weights();
#endif
}
