// How scene colours become colours of the screen.

import {
  ACESFilmicToneMapping, AgXToneMapping, CustomToneMapping, LinearToneMapping, NeutralToneMapping, ShaderChunk,
} from 'three';

/** toneMap of colour.js: c (1 + Y/Y_white²)/(1 + Y), Y_white = 4. */
export const CURVE = /* glsl */`
vec3 sgdbakeCurve(vec3 color) {
  float y = max(dot(color, vec3(0.212639, 0.715169, 0.072192)), 0.0);
  return clamp(color * ((1.0 + y / 16.0) / (1.0 + y)), 0.0, 1.0);
}`;

ShaderChunk.tonemapping_pars_fragment = ShaderChunk.tonemapping_pars_fragment.replace(
  'vec3 CustomToneMapping( vec3 color ) { return color; }',
  `${CURVE}\nvec3 CustomToneMapping(vec3 color) { return sgdbakeCurve(toneMappingExposure * color); }`,
);

/** The curves by name. */
export const TONES = {
  sgdbake: {label: 'sgdbake', curve: CustomToneMapping},
  neutral: {label: 'Khronos neutral', curve: NeutralToneMapping},
  agx: {label: 'AgX', curve: AgXToneMapping},
  aces: {label: 'ACES', curve: ACESFilmicToneMapping},
  none: {label: 'none, clipped', curve: LinearToneMapping},
};
