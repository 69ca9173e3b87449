// Under an environment: the browser's balls against `sgdbake preview`, and in an even room.

import assert from 'node:assert/strict';
import {join} from 'node:path';
import {test} from 'node:test';
import {deltaE2000} from '../view/colour.js';
import {drawMaterial, materialsToDraw, withPage} from './ball.mjs';
import {forThree, readExr, readHdr, studio} from './panorama.mjs';
import {sgdbake, withFolder} from './sgdbake.mjs';

const SIZE = 64;
/** Samples a side of a browser's pixel. */
const FINER = 8;
/** A panorama to compare under; converged previews under one with small lamps take minutes. */
const PANORAMA = process.env.SGD_WEB_HDR;

test('in an even room a ball is as bright as its albedo', async () => {
  const even = {width: 16, height: 8, data: new Float32Array(16 * 8 * 4).fill(1)};
  await withPage(async page => {
    await page.evaluate(image => scene.lightWithEnvironment(...image), forThree(even));
    for (const name of ['chrome', 'gold-paint', 'beige-fabric', 'teflon@refit', 'brass@refit']) {
      const picture = await drawMaterial(page, name, SIZE);
      for (const column of [33, 50, 57, 61, 62]) {
        const found = picture.subarray(4 * (SIZE / 2 * SIZE + column), 4 * (SIZE / 2 * SIZE + column) + 3);
        albedoAt(name, column).forEach((albedo, channel) => {
          const error = Math.abs(found[channel] - albedo) / Math.max(albedo, 0.02);
          assert.ok(error <= FURNACE, `${name}, column ${column}: ${found[channel]}, not ${albedo}`);
        });
      }
    }
  });
});

/** The largest relative error of an albedo; of dark ones in relation to 0.02. */
const FURNACE = 0.005;

/** The albedo of the pixel in a column of the middle row. */
function albedoAt(name, column) {
  const [x, y] = [(2 * column + 1) / SIZE - 1, 1 / SIZE];
  const wo = [Math.hypot(x, y), 0, Math.sqrt(1 - x * x - y * y)];
  const {r, g, b} = JSON.parse(sgdbake('sample', '--material', name, '--wo', wo.join(','), '-n', '2', '--seed', '1', '--json'));
  return [r, g, b].map(({quadrature}) => quadrature);
}

test('under the studio lights a ball looks as it does in preview', async () => {
  await compare(studio(), ['--samples', '2048']);
});

test('under a panorama with small lamps too', {skip: !PANORAMA && 'SGD_WEB_HDR=FILE.hdr names one'}, async () => {
  await compare(readHdr(PANORAMA), ['--environment', PANORAMA, '--samples', '16384']);
});

/** The mean ΔE2000 that nine in ten materials keep. */
const LARGEST = 1;

async function compare(panorama, options) {
  await withPage(async page => {
    await page.evaluate(image => scene.lightWithEnvironment(...image), forThree(panorama));
    const differences = [];
    for (const name of materialsToDraw()) {
      const preview = converged(name, options);
      const picture = await drawMaterial(page, name, SIZE * FINER);
      differences.push(meanDifference(picture, preview));
      console.log(`${name}: mean ΔE2000 ${differences.at(-1).toFixed(2)}`);
    }
    const within = differences.filter(difference => difference <= LARGEST).length;
    const sorted = [...differences].sort((a, b) => a - b);
    console.log(`median ${sorted[sorted.length >> 1].toFixed(2)}, largest ${sorted.at(-1).toFixed(2)}, ${within} of ${sorted.length} within ${LARGEST}`);
    assert.ok(within >= 0.9 * differences.length, `${within} of ${differences.length} within ${LARGEST}`);
  });
}

function converged(name, options) {
  return withFolder(folder => {
    const file = join(folder, 'ball.exr');
    sgdbake('preview', '--material', name, ...options, '--size', String(SIZE), '--quiet', '-o', file);
    return readExr(file);
  });
}

/** Mean ΔE2000 over the pixels that the ball covers; three.js's rows come from the bottom. */
function meanDifference(picture, preview) {
  const side = SIZE * FINER;
  let [sum, count] = [0, 0];
  for (let row = 0; row < SIZE; row++) {
    for (let column = 0; column < SIZE; column++) {
      const at = 4 * ((SIZE - 1 - row) * SIZE + column);
      const found = blockMean(picture, side, (SIZE - 1 - row) * FINER, column * FINER);
      const expected = [...preview.data.subarray(at, at + 4)];
      if (found[3] < 1 || expected[3] < 1) continue;
      sum += deltaE2000(found.slice(0, 3), expected.slice(0, 3));
      count++;
    }
  }
  return sum / count;
}

function blockMean(picture, side, row, column) {
  const mean = [0, 0, 0, 0];
  for (let j = row; j < row + FINER; j++) {
    for (let i = column; i < column + FINER; i++) {
      for (let c = 0; c < 4; c++) mean[c] += picture[4 * (j * side + i) + c] / FINER / FINER;
    }
  }
  return mean;
}
