VARYING vec2 v_uv;
uniform sampler2D u_picture;

// Half-sized, linear filtering at the corners of four texels is their box mean.
void main() { FRAG_COLOR = SAMPLE_2D(u_picture, v_uv); }
