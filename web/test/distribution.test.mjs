// The distribution and its masking against values of 40 digits.

import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {join} from 'node:path';
import {test} from 'node:test';
import {Masking, ShiftedGamma} from '../src/distribution.js';
import {ROOT, body, catalogue} from './sgdbake.mjs';

/** Of all 300 lobes of the published fits, by "material,channel". */
function shapes() {
  const entries = catalogue().flatMap(name =>
    body(name).lobes.map(({alpha, p}, index) => [`${name},${'rgb'[index]}`, new ShiftedGamma(alpha, p)]));
  return new Map(entries);
}

test('D and G1 are the reference', () => {
  const distributions = shapes();
  const lines = readFileSync(join(ROOT, 'tests/data/sgd-reference.csv'), 'utf8').trim().split('\n').slice(1);
  assert.equal(lines.length, 2400);
  let [worstD, worstG1] = [0, 0];
  for (const line of lines) {
    const [material, channel, degrees, ndf, , masking] = line.split(',');
    const distribution = distributions.get(`${material},${channel}`);
    const theta = Number(degrees) * Math.PI / 180;
    const x = Math.tan(theta) ** 2;
    if (Number(ndf) > 1e-200) worstD = Math.max(worstD, Math.abs(distribution.slopeDensity(x) * (1 + x) ** 2 / ndf - 1));
    worstG1 = Math.max(worstG1, Math.abs(distribution.g1(Math.cos(theta)) / masking - 1));
  }
  console.log(`largest relative errors: D ${worstD.toExponential(1)}, G1 ${worstG1.toExponential(1)}`);
  assert.ok(worstD < 1e-9 && worstG1 < 1e-5);
});

test('the masking polynomials are the masking, in single precision too', () => {
  let worst = 0;
  for (const distribution of shapes().values()) {
    const masking = new Masking(distribution);
    masking.coefficients = masking.coefficients.map(Math.fround);
    for (let k = 0; k < 120; k++) {
      const cos = Math.exp(-k / 8);
      worst = Math.max(worst, Math.abs(masking.visibility(cos) * cos / distribution.g1(cos) - 1));
    }
  }
  console.log(`largest relative error of G1: ${worst.toExponential(1)}`);
  assert.ok(worst < 3e-5);
});
