// light map = constant + sum over k of w[k] * mantissa_k(p) * 2^(E_k(p) - E_ref). Mantissas are normalised to
// [-1, 1) and the rest of each plane's factor is in its weight. The bias goes before the weight:
// taken out of the sum it would cost half floats most of their bits.
#ifdef RELIT_MEDIUMP
// lo/255 comes back from the sampler rounded to 11 bits; the integer it stands for is exact.
#define BYTE(x) floor((x) * 255.0 + 0.5)
#else
#define BYTE(x) ((x) * 255.0)
#endif

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

float mantissa8(vec4 t) { return (BYTE(t.r) - 128.0) * (1.0 / 128.0); }

float mantissa10(vec4 t) {
  return ((BYTE(t.HIGH_BYTE) - 2.0) * 256.0 + BYTE(t.LOW_BYTE)) * (1.0 / 512.0);
}

float power(vec4 t, float reference) {
  float e = floor(t.r * 255.0 + 0.5);
  return e > 0.5 ? exp2(e - reference) : 0.0;
}

uniform vec3 u_constant;
