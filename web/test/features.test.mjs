// What a MeshPhysicalMaterial has, a MeshSGDMaterial has too: each feature by the relation in which pictures with and
// without it stand.

import assert from 'node:assert/strict';
import {after, before, test} from 'node:test';
import {openBrowser, openModule} from './chromium.mjs';
import {gltfOf} from './ball.mjs';
import {body, sgdbake} from './sgdbake.mjs';

const NAME = 'gold-paint@refit';
const SIZE = 33;
const CENTRE = (SIZE * SIZE - 1) / 2;
const LEFT = CENTRE - 8;
const RIGHT = CENTRE + 8;
const TINT = [0.5, 0.25, 1];

let browser, page;
before(async () => {
  browser = await openBrowser();
  page = await openModule(browser.context, 'browser/features.js', 'features');
  await page.evaluate(extension => features.use(extension), body(NAME));
});
after(() => browser?.close());

const pictures = feature => page.evaluate(name => features[name](), feature);
const pixel = (picture, index) => picture.slice(4 * index, 4 * index + 4);
const rgb = (picture, index = CENTRE) => pixel(picture, index).slice(0, 3);

/** Each number within `relative` of what is expected of it. */
function near(found, expected, relative, what) {
  assert.equal(found.length, expected.length);
  found.forEach((value, k) => {
    const bound = relative * Math.max(Math.abs(expected[k]), 1e-3);
    assert.ok(Math.abs(value - expected[k]) <= bound, `${what ?? ''} [${k}]: ${value}, not ${expected[k]}`);
  });
}

/** The largest difference of two pictures. */
const difference = (a, b) => Math.max(...a.map((value, k) => Math.abs(value - b[k])));

/** Pixels that differ by more than 1 %: a silhouette may fall differently. */
const differing = (a, b) => a.filter((value, k) => Math.abs(value - b[k]) > 0.01 * Math.max(Math.abs(b[k]), 0.01)).length / a.length;

test('a normal map is a tilted normal', async () => {
  const {mapped, tilted, flat} = await pictures('normalMap');
  near(mapped, tilted, 1e-4);
  assert.ok(difference(mapped, flat) > 0.05);
});

test('an occlusion map dims indirect light, and no direct light', async () => {
  const {ambient, sun, room} = await pictures('occlusion');
  near(rgb(ambient[1]), rgb(ambient[0]).map(c => c / 2), 1e-5);
  near(sun[1], sun[0], 0);
  assert.ok(rgb(room[1]).every((c, k) => c < 0.95 * rgb(room[0])[k]));
  assert.deepEqual(rgb(room[2]), [0, 0, 0]);
});

test('emission is added', async () => {
  const {dark, glowing} = await pictures('emissive');
  near(rgb(glowing).map((c, k) => c - rgb(dark)[k]), [0.5, 0.25, 0.5], 1e-5);
});

test('alpha below the cutoff is cut out, alpha above it is whole', async () => {
  const {whole, masked} = await pictures('mask');
  assert.deepEqual(pixel(masked, LEFT), [0, 0, 0, 0]);
  near(rgb(masked, RIGHT), rgb(whole, RIGHT), 1e-6);
});

test('blending mixes by opacity', async () => {
  const {front, behind, blended} = await pictures('blend');
  near(rgb(blended), rgb(front).map((c, k) => 0.25 * c + 0.75 * rgb(behind)[k]), 1e-5);
});

test('a double-sided back is lit as a front', async () => {
  const {front, back, both} = await pictures('doubleSide');
  assert.deepEqual(pixel(back, CENTRE), [0, 0, 0, 0]);
  near(rgb(both), rgb(front), 1e-5);
});

test('in shadow there is no sun', async () => {
  const {shaded, open, unlit} = await pictures('shadow');
  assert.deepEqual(pixel(shaded, CENTRE), pixel(unlit, CENTRE));
  const corner = 4 * SIZE + 4;
  assert.deepEqual(pixel(shaded, corner), pixel(open, corner));
  assert.ok(rgb(open).every((c, k) => c > 1.5 * rgb(unlit)[k]));
});

for (const [feature, moved, what] of [['skinning', 'skinned', 'skinned'], ['morph', 'morphed', 'morphed']]) {
  test(`a ${what} mesh is drawn as its baked geometry`, async () => {
    const {rest, baked, [moved]: picture} = await pictures(feature);
    const shared = differing(picture, baked);
    assert.ok(shared < 0.01, `${shared} of the numbers differ`);
    assert.ok(differing(picture, rest) > 0.1);
  });
}

test('instances are drawn as meshes, and their colours tint', async () => {
  const {baked, instanced, tinted} = await pictures('instancing');
  assert.ok(differing(instanced, baked) < 0.002);
  const at = CENTRE - 8;
  assert.ok(rgb(instanced, at).every(c => c > 0));
  near(rgb(tinted, at), rgb(instanced, at).map((c, k) => c * TINT[k]), 1e-5);
});

test('fog mixes by distance', async () => {
  const {clear, linear, exponential} = await pictures('fog');
  const colour = [0.1, 0.6, 0.3];
  const mixed = factor => rgb(clear).map((c, k) => c + factor * (colour[k] - c));
  // The plane is at distance 5: smoothstep of (5 − 3)/(8 − 3); 1 − exp(−(0.2 · 5)²).
  near(rgb(linear), mixed(0.4 ** 2 * (3 - 0.8)), 1e-4);
  near(rgb(exponential), mixed(1 - Math.exp(-1)), 1e-4);
});

test('tone mapping is three.js’s', async () => {
  const {linear, mapped, plain} = await pictures('toneMapping');
  const reinhard = c => 2.5 * c / (1 + 2.5 * c);
  const byte = c => 255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055);
  rgb(linear).forEach((c, k) => {
    assert.ok(Math.abs(rgb(mapped)[k] - byte(reinhard(c))) <= 1, `${rgb(mapped)[k]}, not ${byte(reinhard(c))}`);
    assert.ok(Math.abs(rgb(plain)[k] - byte(c)) <= 1, `${rgb(plain)[k]}, not ${byte(c)}`);
  });
  assert.ok(difference(rgb(mapped), rgb(plain)) > 10);
});

test('a point light is a sun over the square of its distance', async () => {
  const {sun, near: close, far, undimmed} = await pictures('point');
  near(rgb(close), rgb(sun).map(c => c / 1.5 ** 2), 1e-4);
  near(rgb(far), rgb(sun).map(c => c / 9), 1e-4);
  near(rgb(undimmed), rgb(sun), 1e-4);
});

test('a spot light is a sun within its cone, and fades in its penumbra', async () => {
  const {sun, within, edge, beyond} = await pictures('spot');
  near(rgb(within), rgb(sun), 1e-4);
  const [outer, inner] = [Math.cos(0.5), Math.cos(0.25)];
  const x = (Math.cos(0.4) - outer) / (inner - outer);
  near(rgb(edge), rgb(sun).map(c => c * x * x * (3 - 2 * x)), 1e-3);
  assert.deepEqual(rgb(beyond), [0, 0, 0]);
});

test('a luminous ceiling shows the albedo, a small rectangle its irradiance', async () => {
  const {ceiling, behind, matte} = await pictures('rectArea');
  near(rgb(ceiling), albedo(), 0.01);
  // three.js clips at the horizon by an approximation.
  assert.ok(rgb(behind).every((c, k) => Math.abs(c) < 0.01 * rgb(ceiling)[k]), `${rgb(behind)}`);
  // Radiance 1e4, 0.02 a side, at distance 2.
  near(rgb(matte), body(NAME).diffuse.map(c => c / Math.PI * 1e4 * 0.02 ** 2 / 4), 2e-3);
});

/** The directional albedo seen at an angle of 0.6 from the normal. */
function albedo() {
  const {r, g, b} = JSON.parse(sgdbake('sample', '--material', NAME, '--wo', `${Math.sin(0.6)},0,${Math.cos(0.6)}`, '-n', '2', '--seed', '1', '--json'));
  return [r, g, b].map(({quadrature}) => quadrature);
}

test('ambient light, hemispheres, probes and light maps light the diffuse part', async () => {
  const {ambient, hemisphere, probe, lightMap} = await pictures('indirect');
  const {diffuse} = body(NAME);
  const lit = irradiance => diffuse.map((c, k) => c * irradiance[k]);
  near(rgb(ambient), lit([1, 0.5, 0.25]), 1e-5);
  // The plane leans back by 0.6: its normal's y is sin 0.6.
  const sky = 0.5 + 0.5 * Math.sin(0.6);
  near(rgb(hemisphere), lit([sky, 0.5, 1 - sky]), 1e-4);
  // The irradiance of the constant coefficient c is 0.886227 c.
  near(rgb(probe), lit([1, 0.5, 0.25].map(c => 0.886227 * c)), 1e-4);
  near(rgb(lightMap), lit([0.5, 0.25, 1].map(c => 2 * c / Math.PI)), 1e-4);
});

test('textures and vertex colours tint the reflection', async () => {
  const {plain, mapped, coloured} = await pictures('tint');
  for (const picture of [mapped, coloured]) near(rgb(picture), rgb(plain).map((c, k) => c * TINT[k]), 1e-5);
});

test('the plugin hands on what a glTF material has', async () => {
  const gltf = gltfOf([body(NAME), body(NAME), body(NAME)]);
  gltf.images = [{uri: `data:image/png;base64,${PIXEL}`}];
  gltf.textures = [{source: 0}];
  Object.assign(gltf.materials[0], {
    doubleSided: true, alphaMode: 'MASK', alphaCutoff: 0.3, emissiveFactor: [0.5, 0.25, 1],
    normalTexture: {index: 0, scale: 0.5}, occlusionTexture: {index: 0, strength: 0.75}, emissiveTexture: {index: 0},
  });
  gltf.materials[0].pbrMetallicRoughness.baseColorTexture = {index: 0};
  gltf.materials[0].extensions.KHR_materials_emissive_strength = {emissiveStrength: 3};
  gltf.materials[1].alphaMode = 'BLEND';
  gltf.materials[1].pbrMetallicRoughness.baseColorFactor[3] = 0.5;
  const [masked, blended, plain] = await page.evaluate(json => features.loaded(json), gltf);
  assert.deepEqual(masked, {
    exact: true, transparent: false, opacity: 1, alphaTest: 0.3, doubleSided: true, normalScale: 0.5, aoMapIntensity: 0.75,
    emissive: [0.5, 0.25, 1], emissiveIntensity: 3, maps: ['map', 'normalMap', 'aoMap', 'emissiveMap'],
  });
  assert.deepEqual([blended.transparent, blended.opacity, blended.doubleSided], [true, 0.5, false]);
  assert.deepEqual([plain.exact, plain.transparent, plain.alphaTest, plain.maps], [true, false, 0, []]);
});

/** A white PNG of one pixel. */
const PIXEL = 'iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGP4DwABAQEAsTj2FAAAAABJRU5ErkJggg==';
