#ifdef SQUARE_ROOT
  vec3 root = sqrt(clamp(sum * u_to_unit, 0.0, 1.0));
  FRAG_COLOR = vec4(root + dither(gl_FragCoord.xy) * (1.0 / 255.0), 1.0);
#else
  FRAG_COLOR = vec4(sum, 1.0);
#endif
}
