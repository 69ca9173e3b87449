// Under suns, the browser's pictures are the model itself: every lit pixel against `sgdbake eval`.

import assert from 'node:assert/strict';
import {test} from 'node:test';
import {drawMaterial, floats, materialsToDraw, withPage} from './ball.mjs';
import {evaluate} from './sgdbake.mjs';

const SIZE = 96;
/** The key light, near the viewer, grazing from the right, from above, and from behind. */
const SUNS = [[-0.5, 0.5, Math.SQRT1_2], [0.05, 0.08, 1], [0.95, 0.2, -0.25], [0.1, 1, 0.15], [-0.6, -0.3, -0.7]];
/** The largest relative root mean square of a material's pictures. */
const LARGEST = 0.005;

test('suns on balls are the model', async () => {
  await withPage(async page => {
    const normals = floats(await page.evaluate(size => scene.drawNormals(size), SIZE));
    const views = SUNS.map(sun => ({sun, pixels: litPixels(normals, unit(unit(sun).map(Math.fround)))}));
    for (const name of materialsToDraw()) {
      const {ofPicture, ofPixels} = await deviation(page, name, views);
      console.log(`${name}: relative RMS ${ofPicture.toExponential(1)}, of single pixels ${ofPixels.toExponential(1)}`);
      assert.ok(ofPicture <= LARGEST, `${name}: relative RMS ${ofPicture} of the pictures`);
    }
  });
});

/** √(Σ (a − b)²/Σ b²) over the pictures, and √ of the mean of (a/b − 1)² where b is not 0. */
async function deviation(page, name, views) {
  const truth = evaluate(name, views.flatMap(({pixels}) => pixels.map(({pair}) => pair)));
  let [square, norm, relative, count, single] = [0, 0, 0, 0, 0];
  for (const {sun, pixels} of views) {
    await page.evaluate(direction => scene.lightWithSun(direction), sun);
    const picture = await drawMaterial(page, name, SIZE);
    for (const {index, pair: [wi]} of pixels) {
      truth[count++].forEach((f, channel) => {
        const [expected, found] = [f * wi[2] * Math.PI, picture[4 * index + channel]];
        square += (found - expected) ** 2;
        norm += expected ** 2;
        if (expected === 0) return;
        relative += (found / expected - 1) ** 2;
        single++;
      });
    }
  }
  return {ofPicture: Math.sqrt(square / norm), ofPixels: Math.sqrt(relative / single)};
}

/** The pixels that a sun lights, with [wi, wo] in their own frames. */
function litPixels(normals, sun) {
  const pixels = [];
  for (let index = 0; index < SIZE * SIZE; index++) {
    if (normals[4 * index + 3] === 0) continue;
    const axes = frame(unit([...normals.subarray(4 * index, 4 * index + 3)]));
    const [wi, wo] = [axes.map(axis => dot(axis, sun)), axes.map(axis => axis[2])];
    if (wi[2] > 1e-6 && wo[2] > 0) pixels.push({index, pair: [wi, wo]});
  }
  return pixels;
}

/** Axes whose third is the normal (Duff et al. 2017). */
function frame([x, y, z]) {
  const sign = z < 0 ? -1 : 1;
  const a = -1 / (sign + z);
  const b = x * y * a;
  return [[1 + sign * x * x * a, sign * b, -sign * x], [b, sign + y * y * a, -y], [x, y, z]];
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
function unit(v) {
  const length = Math.hypot(...v);
  return v.map(c => c / length);
}
