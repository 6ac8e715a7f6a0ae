VARYING vec2 v_uv;
uniform vec4 u_top;
uniform vec4 u_bottom;

void main() {
  vec4 color = mix(u_bottom, u_top, v_uv.y);
  FRAG_COLOR = vec4(color.rgb + dither(gl_FragCoord.xy) * (1.0 / 255.0), color.a);
}
