// What GLTFLoader makes of the extension: whole, broken, of another version.

import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {join} from 'node:path';
import {test} from 'node:test';
import {gltfOf, withPage} from './ball.mjs';
import {body, sgdbake, withFolder} from './sgdbake.mjs';

test('an exported GLB loads as the exact material', async () => {
  const glb = withFolder(folder => {
    const file = join(folder, 'ball.glb');
    sgdbake('export', '--shape', 'ball', '--assign', '*=gold-paint@refit', '-o', file);
    return readFileSync(file).toString('base64');
  });
  await withPage(async page => {
    const [{exact, parameters, type}] = await page.evaluate(data => scene.describeGlb(data), glb);
    assert.ok(exact);
    assert.equal(type, 'MeshPhysicalMaterial');
    const {diffuse, lobes} = body('gold-paint@refit');
    assert.deepEqual(parameters.diffuse, diffuse);
    assert.deepEqual(parameters.lobes.map(lobe => lobe.rhoS), lobes.map(lobe => lobe.rho_s));
  });
});

test('a broken or newer extension leaves the fit, with one warning a file', async () => {
  const whole = body('gold-paint');
  const broken = [
    {...whole, version: 3},
    {...whole, diffuse: [0.1, 0.2]},
    {...whole, lobes: [{...whole.lobes[0], alpha: 0}]},
    {...whole, lobes: [{...whole.lobes[0], f0: [0, null, 0]}]},
    {...whole, lobes: new Array(4).fill(whole.lobes[0])},
    {...whole, lobes: 'three'},
  ];
  await withPage(async page => {
    const warnings = [];
    page.on('console', message => { if (message.type() === 'warning' && message.text().startsWith('SGD_')) warnings.push(message.text()); });
    const described = await page.evaluate(gltf => scene.describe(gltf), gltfOf([...broken, whole]));
    assert.deepEqual(described.map(({exact}) => exact), [...broken.map(() => false), true]);
    assert.deepEqual(described[0].colour.map(c => Number(c.toFixed(4))), [0.2, 0.4, 0.6]);
    assert.equal(warnings.length, 1);
    assert.match(warnings[0], /version 3 is unknown.*glTF material is shown/);
  });
});
