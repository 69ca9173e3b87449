// The colours of differences: those of sgdbake's sheets.

/** ΔE2000 at the scale's end. */
export const SCALE_END = 10;

/** Colours at even steps from 0 to SCALE_END. */
export const SCALE = [[13, 8, 66], [70, 16, 120], [145, 33, 118], [214, 69, 79], [249, 142, 32], [252, 232, 120]];

export const gradient = () => `linear-gradient(to right, ${SCALE.map(c => `rgb(${c.join(' ')})`).join(', ')})`;

/** The scale as a function of GLSL: sRGB of a difference. */
export const HEAT = /* glsl */`
vec3 heat(float difference) {
  vec3 scale[${SCALE.length}] = vec3[](${SCALE.map(c => `vec3(${c.map(x => (x / 255).toFixed(4)).join(', ')})`).join(', ')});
  float position = clamp(difference / ${SCALE_END.toFixed(1)}, 0.0, 1.0) * ${(SCALE.length - 1).toFixed(1)};
  int left = min(int(position), ${SCALE.length - 2});
  return mix(scale[left], scale[left + 1], position - float(left));
}`;
