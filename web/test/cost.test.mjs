// What a frame costs, beside a MeshPhysicalMaterial of the same picture.

import assert from 'node:assert/strict';
import {test} from 'node:test';
import {gltfOf, withPage} from './ball.mjs';
import {forThree, studio} from './panorama.mjs';
import {body} from './sgdbake.mjs';

// Minutes in software GL.
const skip = !process.env.SGD_WEB_COST && 'SGD_WEB_COST=1 measures it';

test('frames are drawn, and their cost is told', {skip}, async () => {
  await withPage(async page => {
    for (const light of ['one sun', 'environment']) {
      await page.evaluate(([sun, image]) => (sun ? scene.lightWithSun([-0.5, 0.5, 0.7]) : scene.lightWithEnvironment(...image)),
        [light === 'one sun', forThree(studio())]);
      for (const name of ['gold-paint', 'gold-paint@refit']) {
        const [physical, exact] = await page.evaluate(async gltf => {
          const [material] = await scene.loadMaterials(gltf);
          const fit = new scene.MeshPhysicalMaterial({roughness: 0.4, metalness: 0.2, specularIntensity: 0.8});
          // In turns, so that what else the machine does slows both.
          const rounds = Array.from({length: 5}, () => [fit, material].map(each => scene.frameTime(each, 512, 6)));
          return [0, 1].map(k => Math.min(...rounds.map(round => round[k])));
        }, gltfOf([body(name)]));
        console.log(`${name}, ${light}: ${exact.toFixed(1)} ms a frame, ${(exact / physical).toFixed(1)} times a MeshPhysicalMaterial's ${physical.toFixed(1)}`);
        assert.ok(exact > 0 && physical > 0);
      }
    }
  });
});
