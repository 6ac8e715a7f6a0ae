  // s * E(N): a plane, and the normal at the texel from three more. The weights are E's nine coefficients with
  // s's factor, of the polynomial below; the first one's fourth number is E_ref. One tap adds colours, four
  // taps add taps: either way four numbers at a time.
#define PREDICTED(c) (HARMONIC_0.c + HARMONIC_1.c * y + HARMONIC_2.c * z + HARMONIC_3.c * x + HARMONIC_4.c * xy + HARMONIC_5.c * yz + HARMONIC_6.c * zz + HARMONIC_7.c * xz + HARMONIC_8.c * xx)
  {
#ifdef GROUP_UV_0
    float s = BATCH_MANTISSA(SAMPLE_2D(BATCH_SHEET_0, GROUP_UV_0));
    float x = normal16(SAMPLE_2D(BATCH_SHEET_1, GROUP_UV_1));
    float y = normal16(SAMPLE_2D(BATCH_SHEET_2, GROUP_UV_2));
    float z = normal16(SAMPLE_2D(BATCH_SHEET_3, GROUP_UV_3));
#ifdef BATCH_EXPONENTS
    s *= power(SAMPLE_2D(BATCH_EXPONENTS, GROUP_UV_E), BATCH_WEIGHTS[0].a);
#endif
#define TAPS float
#else
    TAPS s = TAPS(tap_share);
#ifdef BATCH_EXPONENTS
    tap_reference = BATCH_WEIGHTS[0].a;
    AIM(PLACE_E);
    s *= TAP(tap_power, BATCH_EXPONENTS);
#endif
    AIM(PLACE_0);
    s *= TAP(BATCH_MANTISSA, BATCH_SHEET_0);
    AIM(PLACE_1);
    TAPS x = TAP(normal16, BATCH_SHEET_1);
    AIM(PLACE_2);
    TAPS y = TAP(normal16, BATCH_SHEET_2);
    AIM(PLACE_3);
    TAPS z = TAP(normal16, BATCH_SHEET_3);
#endif
    TAPS xy = x * y, yz = y * z, zz = 3.0 * z * z - 1.0, xz = x * z, xx = x * x - y * y;
#ifdef FOUR_TAPS
    sum += vec3(dot(s, PREDICTED(r)), dot(s, PREDICTED(g)), dot(s, PREDICTED(b)));
#else
    sum += s * PREDICTED(rgb);
#endif
#ifdef GROUP_UV_0
#undef TAPS
#endif
  }
#undef PREDICTED
