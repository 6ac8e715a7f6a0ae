ATTRIBUTE vec2 a_position;
uniform mat3 u_rays;  // from (x, y, 1) in normalised device coordinates to a direction
VARYING vec3 v_ray;

void main() {
  v_ray = u_rays * vec3(a_position, 1.0);
  gl_Position = vec4(a_position, 0.0, 1.0);
}
