// One batch of groups that fetch from the same sheets. A group is 1 or 3 planes with one exponent or
// none; its vectors are, for each plane, its place (offset and scale from texels to the sheet) and its
// weight (E_ref in .a of the first), then the exponent's place.
uniform vec4 BATCH_DATA[BATCH_GROUPS * BATCH_STRIDE];
uniform int BATCH_COUNT;

vec3 BATCH_SUM() {
  vec3 sum = vec3(0.0);
  vec2 low, high;
  for (int i = 0; i < BATCH_GROUPS; ++i) {
    if (i >= BATCH_COUNT) break;
    vec4 weight = BATCH_DATA[i * BATCH_STRIDE + 1];
    TAPS share = TAPS(tap_share);
#ifdef BATCH_EXPONENTS
    tap_reference = weight.a;
    AIM(BATCH_DATA[i * BATCH_STRIDE + BATCH_STRIDE - 1]);
    share *= TAP(tap_power, BATCH_EXPONENTS);
#endif
    AIM(BATCH_DATA[i * BATCH_STRIDE]);
    sum += weight.rgb * dot(TAP(BATCH_MANTISSA, BATCH_SHEET_0), share);
#if BATCH_PLANES == 3
    AIM(BATCH_DATA[i * BATCH_STRIDE + 2]);
    sum += BATCH_DATA[i * BATCH_STRIDE + 3].rgb * dot(TAP(BATCH_MANTISSA, BATCH_SHEET_1), share);
    AIM(BATCH_DATA[i * BATCH_STRIDE + 4]);
    sum += BATCH_DATA[i * BATCH_STRIDE + 5].rgb * dot(TAP(BATCH_MANTISSA, BATCH_SHEET_2), share);
#endif
  }
  return sum;
}
