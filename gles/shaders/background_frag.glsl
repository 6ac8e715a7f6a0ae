VARYING vec3 v_ray;
uniform samplerCube u_environment;
uniform float u_scale;

void main() {
  vec4 texel = SAMPLE_CUBE(u_environment, v_ray);
#ifdef SHARED_ROOT
  // Square roots with a shared multiplier in alpha.
  vec3 radiance = texel.rgb * texel.a;
  radiance *= radiance;
#else
  vec3 radiance = texel.rgb;
#endif
  FRAG_COLOR = vec4(display(radiance * u_scale, gl_FragCoord.xy), 1.0);
}
