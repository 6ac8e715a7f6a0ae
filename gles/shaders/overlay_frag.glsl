VARYING vec2 v_uv;
VARYING vec4 v_color;
uniform sampler2D u_letters;

void main() {
  FRAG_COLOR = vec4(v_color.rgb, v_color.a * SAMPLE_2D(u_letters, v_uv).r);
}
