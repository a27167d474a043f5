// A pane of the window: of linear sensor values to what a screen shows (D65, IEC 61966-2-1).

in vec2 at;

uniform sampler2D canvas, photograph, map;
uniform vec2 pane_size, picture_size, picture_centre;  // pixels
uniform float pane_scale;                              // pane pixels per pixel of the photograph
uniform int left_source, right_source;                 // 0 viewer, 1 photograph, 2 map, 3 canvas as it is
uniform float divider;                                 // 0..1: what is left of it shows left_source
uniform float viewer_scale, photograph_scale;
uniform mat3 rgb_from_sensor;

out vec4 pixel;

const vec3 kNoPicture = vec3(0.10, 0.10, 0.11);

vec3 Encoded(vec3 linear) {
  vec3 c = clamp(linear, 0.0, 1.0);
  return mix(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, 12.92 * c, lessThanEqual(c, vec3(0.0031308)));
}

void main() {
  int source = at.x < divider ? left_source : right_source;
  vec2 in_canvas = vec2(at.x, 1.0 - at.y);
  vec2 in_picture = ((at - 0.5) * pane_size / pane_scale + picture_centre) / picture_size;
  bool outside = any(lessThan(in_picture, vec2(0.0))) || any(greaterThan(in_picture, vec2(1.0)));
  vec3 shown;
  if (source == 0) {
    vec4 drawn = texture(canvas, in_canvas);
    shown = vec3(0.0);
    if (drawn.a > 0.0) shown = Encoded(viewer_scale * (rgb_from_sensor * drawn.rgb));  // powers are dear in software
  } else if (source == 3) {
    shown = texture(canvas, in_canvas).rgb;
  } else if (outside) {
    shown = kNoPicture;
  } else {
    shown = source == 1 ? Encoded(photograph_scale * (rgb_from_sensor * texture(photograph, in_picture).rgb))
                        : texture(map, in_picture).rgb;
  }
  pixel = vec4(shown, 1.0);
}
