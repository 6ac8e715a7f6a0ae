// From linear radiance, exposed, to what a display expects.

vec3 decode_srgb(vec3 c) {
  vec3 low = c * (1.0 / 12.92);
  vec3 high = pow((c + 0.055) * (1.0 / 1.055), vec3(2.4));
  return mix(high, low, vec3(lessThanEqual(c, vec3(0.04045))));
}

// 1.055, or the half float above it, so that white does not come out a step too dark.
#ifdef RELIT_MEDIUMP
#define SRGB_GAIN 1.0557
#else
#define SRGB_GAIN 1.055
#endif

vec3 encode_srgb(vec3 c) {
  vec3 low = c * 12.92;
  vec3 high = SRGB_GAIN * pow(max(c, vec3(0.0001)), vec3(1.0 / 2.4)) - 0.055;
  return mix(high, low, vec3(lessThanEqual(c, vec3(0.0031308))));
}

// Half floats overflow in the curves' squares beyond 255; every curve is white well before 100.
vec3 tone_map(vec3 c) {
  c = min(c, vec3(100.0));
#if TONE_MAP == 1
  // Narkowicz's fit to the ACES filmic curve (2015).
  return clamp((c * (2.51 * c + 0.03)) / (c * (2.43 * c + 0.59) + 0.14), 0.0, 1.0);
#elif TONE_MAP == 2
  // Khronos PBR Neutral: identity (less a toe for Fresnel reflection) up to 0.76, then hyperbolic
  // compression of the peak with a shift towards white.
  float least = min(c.r, min(c.g, c.b));
  c -= least < 0.08 ? least - 6.25 * least * least : 0.04;
  float peak = max(c.r, max(c.g, c.b));
  if (peak < 0.76) return c;
  float compressed = 1.0 - 0.24 * 0.24 / (peak - 0.52);
  c *= compressed / peak;
  float toward_white = 1.0 - 1.0 / (0.15 * (peak - compressed) + 1.0);
  return mix(c, vec3(compressed), toward_white);
#else
  return min(c, vec3(1.0));
#endif
}

vec3 display(vec3 radiance, vec2 pixel) {
  return encode_srgb(tone_map(radiance)) + dither(pixel) * (1.0 / 255.0);
}
