// Where planes are looked up. Before plane_sum() is called, tap_at is set, in texels: the place of one
// texel's centre, or the two corners of the four centres around a place, whose shares are in tap_share.
#ifdef FOUR_TAPS
#define TAPS vec4
#define TAP(f, sheet) vec4(f(SAMPLE_2D(sheet, low)), f(SAMPLE_2D(sheet, vec2(high.x, low.y))), f(SAMPLE_2D(sheet, vec2(low.x, high.y))), f(SAMPLE_2D(sheet, high)))
#define AIM(place) low = place.xy + tap_at.xy * place.zw; high = place.xy + tap_at.zw * place.zw
vec4 tap_at;
vec4 tap_share;
#else
#define TAPS float
#define TAP(f, sheet) f(SAMPLE_2D(sheet, low))
#define AIM(place) low = place.xy + tap_at * place.zw
#define tap_share 1.0
vec2 tap_at;
#endif

float tap_reference;
float tap_power(vec4 t) { return power(t, tap_reference); }
