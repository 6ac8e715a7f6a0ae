// One batch of groups that fetch from the same sheets. A group is 1 or 3 planes with one exponent or
// none; its vectors are, for each plane, its place (offset and scale from texels to the sheet) and its
// weight (E_ref in .a of the first), then the exponent's place.
uniform vec4 BATCH_DATA[BATCH_GROUPS * BATCH_STRIDE];
uniform int BATCH_COUNT;

vec3 BATCH_SUM(vec2 texel) {
  vec3 sum = vec3(0.0);
  for (int i = 0; i < BATCH_GROUPS; ++i) {
    if (i >= BATCH_COUNT) break;
    vec4 place = BATCH_DATA[i * BATCH_STRIDE];
    vec4 weight = BATCH_DATA[i * BATCH_STRIDE + 1];
    float reference = weight.a;
    vec3 group = weight.rgb * BATCH_MANTISSA(SAMPLE_2D(BATCH_SHEET_0, place.xy + texel * place.zw));
#if BATCH_PLANES == 3
    place = BATCH_DATA[i * BATCH_STRIDE + 2];
    weight = BATCH_DATA[i * BATCH_STRIDE + 3];
    group += weight.rgb * BATCH_MANTISSA(SAMPLE_2D(BATCH_SHEET_1, place.xy + texel * place.zw));
    place = BATCH_DATA[i * BATCH_STRIDE + 4];
    weight = BATCH_DATA[i * BATCH_STRIDE + 5];
    group += weight.rgb * BATCH_MANTISSA(SAMPLE_2D(BATCH_SHEET_2, place.xy + texel * place.zw));
#endif
#ifdef BATCH_EXPONENTS
    place = BATCH_DATA[i * BATCH_STRIDE + BATCH_STRIDE - 1];
    group *= power(SAMPLE_2D(BATCH_EXPONENTS, place.xy + texel * place.zw), reference);
#endif
    sum += group;
  }
  return sum;
}
