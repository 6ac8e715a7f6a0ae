ATTRIBUTE vec2 a_position;
uniform vec4 u_texels;  // scale and offset from [0,1] to the planes' texels

#ifdef LOOKUPS
// Texture coordinates reach the fragment shader as varyings that it passes on unmodified: on GPUs
// with half-float fragments only those keep the precision that texel addresses need.
uniform vec4 u_place[LOOKUPS];
#define PLACE(i) (u_place[i].xy + texel * u_place[i].zw)
#else
VARYING vec2 v_texel;
#endif

void main() {
  vec2 texel = (a_position * 0.5 + 0.5) * u_texels.xy + u_texels.zw;
#ifdef LOOKUPS
  ASSIGN_PLACES
#else
  v_texel = texel;
#endif
  gl_Position = vec4(a_position, 0.0, 1.0);
}
