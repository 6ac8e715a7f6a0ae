  {
    vec4 weight = BATCH_WEIGHTS[GROUP * BATCH_PLANES];
    vec3 group = weight.rgb * BATCH_MANTISSA(SAMPLE_2D(BATCH_SHEET_0, GROUP_UV_0));
#if BATCH_PLANES == 3
    group += BATCH_WEIGHTS[GROUP * BATCH_PLANES + 1].rgb *
             BATCH_MANTISSA(SAMPLE_2D(BATCH_SHEET_1, GROUP_UV_1));
    group += BATCH_WEIGHTS[GROUP * BATCH_PLANES + 2].rgb *
             BATCH_MANTISSA(SAMPLE_2D(BATCH_SHEET_2, GROUP_UV_2));
#endif
#ifdef BATCH_EXPONENTS
    group *= power(SAMPLE_2D(BATCH_EXPONENTS, GROUP_UV_E), weight.a);
#endif
    sum += group;
  }
