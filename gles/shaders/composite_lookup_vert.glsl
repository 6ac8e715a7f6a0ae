// Texture coordinates reach the fragment shader as varyings that it passes on unmodified: on GPUs with
// half-float fragments only those keep the precision that texel addresses need. What follows assigns
// them from `texel`, and ends main().
ATTRIBUTE vec2 a_position;
uniform vec4 u_texels;  // scale and offset from [0,1] to the planes' texels

void main() {
  vec2 texel = (a_position * 0.5 + 0.5) * u_texels.xy + u_texels.zw;
  gl_Position = vec4(a_position, 0.0, 1.0);
