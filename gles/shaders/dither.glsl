// Threshold of the 8x8 Bayer matrix at a pixel, centred: -0.492 to 0.492. Only small integers are
// involved, which half floats hold exactly.
float dither(vec2 pixel) {
  vec2 p = mod(floor(pixel), 8.0);
  vec2 a = mod(p, 2.0);
  vec2 b = mod(floor(p * 0.5), 2.0);
  vec2 c = floor(p * 0.25);
  vec3 bits = 2.0 * abs(vec3(a.x - a.y, b.x - b.y, c.x - c.y)) + vec3(a.y, b.y, c.y);
  return (16.0 * bits.x + 4.0 * bits.y + bits.z + 0.5) * (1.0 / 64.0) - 0.5;
}
