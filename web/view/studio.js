// sgdbake's built-in lights: those of its previews and sheets.

import {DataTexture, EquirectangularReflectionMapping, FloatType, LinearFilter, RGBAFormat, RepeatWrapping} from 'three';

const [WIDTH, HEIGHT] = [256, 128];

/** Lamps (direction, cosine of the half angle, radiance) in a grey room that is brighter above. */
const LAMPS = [
  {to: [-0.5, 0.6, 0.62], edge: 0.93, radiance: 9.0},
  {to: [0.9, 0.1, 0.42], edge: 0.90, radiance: 1.6},
  {to: [0.35, 0.75, -0.56], edge: 0.96, radiance: 12.0},
].map(({to, edge, radiance}) => ({to: to.map(c => c / Math.hypot(...to)), edge, radiance}));

/** Radiance from a unit direction. */
export function studioRadiance([x, y, z]) {
  return LAMPS.reduce((sum, {to, edge, radiance}) => {
    const cos = to[0] * x + to[1] * y + to[2] * z;
    return sum + radiance * Math.min(Math.max((cos - edge) / (0.1 * (1 - edge)), 0), 1);
  }, 0.18 + 0.17 * y);
}

/** The lights as three.js reads a panorama: columns from +x towards +z, rows from the nadir. */
export function studio() {
  const data = new Float32Array(4 * WIDTH * HEIGHT);
  for (let row = 0; row < HEIGHT; row++) {
    const height = Math.PI * ((row + 0.5) / HEIGHT - 0.5);
    for (let column = 0; column < WIDTH; column++) {
      const azimuth = 2 * Math.PI * ((column + 0.5) / WIDTH - 0.5);
      const cos = Math.cos(height);
      const light = studioRadiance([cos * Math.cos(azimuth), Math.sin(height), cos * Math.sin(azimuth)]);
      data.set([light, light, light, 1], 4 * (row * WIDTH + column));
    }
  }
  return panorama(data, WIDTH, HEIGHT, FloatType);
}

/** A texture of light from all around. */
export function panorama(data, width, height, type) {
  const texture = new DataTexture(data, width, height, RGBAFormat, type, EquirectangularReflectionMapping);
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.wrapS = RepeatWrapping;
  texture.needsUpdate = true;
  return texture;
}
