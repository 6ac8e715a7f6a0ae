// light map = constant + sum over k of w[k] * mantissa_k(p) * 2^(E_k(p) - E_ref), and s(p) * E(N(p)) where there
// is a prediction. Mantissas are normalised to
// [-1, 1) and the rest of each plane's factor is in its weight. The bias goes before the weight:
// taken out of the sum it would cost half floats most of their bits.

// The bytes of a 16-bit sample in memory order are red and green (ES 3), luminance and alpha (ES 2).
#ifdef RELIT_ES3
#define SECOND g
#else
#define SECOND a
#endif
#ifdef BIG_ENDIAN
#define LOW_BYTE SECOND
#define HIGH_BYTE r
#else
#define LOW_BYTE r
#define HIGH_BYTE SECOND
#endif

// In full precision and without exponents the bias may be taken out: samples are raw then, and it is in
// u_constant.
#ifdef RELIT_MEDIUMP
// x/255 comes back from the sampler rounded to 11 bits; the integer it stands for is exact.
float byte(float x) { return floor(x * 255.0 + 0.5); }
float mantissa8(vec4 t) { return (byte(t.r) - 128.0) * (1.0 / 128.0); }
float mantissa10(vec4 t) {
  return ((byte(t.HIGH_BYTE) - 2.0) * 256.0 + byte(t.LOW_BYTE)) * (1.0 / 512.0);
}
// Over 32768 instead of 32767, which half floats cannot tell apart, in steps of which none is subnormal.
float normal16(vec4 t) {
  return (byte(t.HIGH_BYTE) - 128.0 + byte(t.LOW_BYTE) * (1.0 / 256.0)) * (1.0 / 128.0);
}
#else
float raw8(vec4 t) { return t.r; }
float raw10(vec4 t) { return t.HIGH_BYTE * 256.0 + t.LOW_BYTE; }
float mantissa8(vec4 t) { return t.r * (255.0 / 128.0) - 1.0; }
float mantissa10(vec4 t) {
  return t.HIGH_BYTE * (255.0 * 256.0 / 512.0) + (t.LOW_BYTE * (255.0 / 512.0) - 1.0);
}
float normal16(vec4 t) {
  return t.HIGH_BYTE * (255.0 * 256.0 / 32767.0) + (t.LOW_BYTE * (255.0 / 32767.0) - 32768.0 / 32767.0);
}
#endif

#ifdef RELIT_ES3
// Exact; 0 below 2^-126, which is nothing beside the largest exponent's 1.
float power(vec4 t, float reference) {
  float e = t.r * 255.0 + 0.5;
  return e > 1.0 ? intBitsToFloat(int(max(e + (127.0 - reference), 0.0)) << 23) : 0.0;
}
#else
float power(vec4 t, float reference) {
  float e = floor(t.r * 255.0 + 0.5);
  return e > 0.5 ? exp2(e - reference) : 0.0;
}
#endif

uniform vec3 u_constant;
