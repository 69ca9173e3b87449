// Equirectangular light for the browser and for `sgdbake preview`.

import {readFileSync} from 'node:fs';
import {EXRLoader} from 'three/addons/loaders/EXRLoader.js';
import {HDRLoader} from 'three/addons/loaders/HDRLoader.js';
import {FloatType} from 'three';

const arrayBuffer = file => {
  const bytes = readFileSync(file);
  return bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);
};

export const readExr = file => new EXRLoader().setDataType(FloatType).parse(arrayBuffer(file));
export const readHdr = file => new HDRLoader().setDataType(FloatType).parse(arrayBuffer(file));

/** sgdbake's built-in lights: (direction, cosine of the half angle, radiance), in a grey room. */
const STUDIO = [
  [[-0.5, 0.6, 0.62], 0.93, 9.0],
  [[0.9, 0.1, 0.42], 0.90, 1.6],
  [[0.35, 0.75, -0.56], 0.96, 12.0],
];

/** The panorama of src/preview/environment.rs, rows from the zenith, columns turning right from −z. */
export function studio() {
  const [width, height] = [256, 128];
  const data = new Float32Array(4 * width * height);
  for (let row = 0; row < height; row++) {
    for (let column = 0; column < width; column++) {
      const polar = Math.PI * (row + 0.5) / height;
      const azimuth = 2 * Math.PI * ((column + 0.5) / width - 0.5);
      const direction = [Math.sin(polar) * Math.sin(azimuth), Math.cos(polar), -Math.sin(polar) * Math.cos(azimuth)];
      data.set([...new Array(3).fill(studioRadiance(direction)), 1], 4 * (row * width + column));
    }
  }
  return {width, height, data};
}

function studioRadiance(direction) {
  return STUDIO.reduce((sum, [to, edge, radiance]) => {
    const cos = to.reduce((dot, c, k) => dot + c * direction[k], 0) / Math.hypot(...to);
    return sum + radiance * Math.min(Math.max((cos - edge) / (0.1 * (1 - edge)), 0), 1);
  }, 0.18 + 0.17 * direction[1]);
}

/** As three.js reads it: columns from +x, rows from the nadir; base64 of RGBA floats. */
export function forThree({width, height, data}) {
  const turned = new Float32Array(data.length);
  for (let row = 0; row < height; row++) {
    for (let column = 0; column < width; column++) {
      const from = 4 * (row * width + (column + width / 4) % width);
      turned.set(data.subarray(from, from + 4), 4 * ((height - 1 - row) * width + column));
    }
  }
  return [width, height, Buffer.from(turned.buffer).toString('base64')];
}
