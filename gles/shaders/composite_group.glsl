  // 1 or 3 planes with one exponent or none. Places are offset and scale from texels to the sheet.
  {
    TAPS share = TAPS(tap_share);
#ifdef BATCH_EXPONENTS
    tap_reference = REFERENCE;
    AIM(PLACE_E);
    share *= TAP(tap_power, BATCH_EXPONENTS);
#endif
    AIM(PLACE_0);
    sum.CHANNELS_0 += WEIGHT_0 * dot(TAP(BATCH_MANTISSA, BATCH_SHEET_0), share);
#if BATCH_PLANES == 3
    AIM(PLACE_1);
    sum.CHANNELS_1 += WEIGHT_1 * dot(TAP(BATCH_MANTISSA, BATCH_SHEET_1), share);
    AIM(PLACE_2);
    sum.CHANNELS_2 += WEIGHT_2 * dot(TAP(BATCH_MANTISSA, BATCH_SHEET_2), share);
#endif
  }
