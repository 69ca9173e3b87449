// Balls in the browser: the page, its pictures, and the materials the tests draw.

import {openBrowser, openModule} from './chromium.mjs';
import {body, catalogue} from './sgdbake.mjs';

/** 24 of the catalogue in both of its kinds, or all of it with SGD_WEB_ALL=1. */
export function materialsToDraw() {
  const names = catalogue();
  if (process.env.SGD_WEB_ALL) return names.flatMap(name => [name, `${name}@refit`]);
  const sharpest = ['chrome', 'chrome-steel', 'specular-orange-phenolic', 'beige-fabric', 'pink-fabric', 'black-fabric'];
  const others = names.filter(name => !sharpest.includes(name));
  const spread = Array.from({length: 18}, (_, k) => others[Math.floor((k + 0.5) * others.length / 18)]);
  return [...sharpest, ...spread].map((name, k) => (k % 3 === 2 ? `${name}@refit` : name));
}

/** Calls `use` with a page that draws balls. */
export async function withPage(use) {
  const {context, close} = await openBrowser();
  try {
    return await use(await openModule(context, 'browser/scene.js', 'scene'));
  } finally {
    await close();
  }
}

/** Floats from the page's base64. */
export function floats(base64) {
  const bytes = Buffer.from(base64, 'base64');
  return new Float32Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
}

/** A glTF of nothing but materials: bodies of the extension, each with a fit to fall back on. */
export const gltfOf = bodies => ({
  asset: {version: '2.0'},
  materials: bodies.map(extension => ({
    name: extension.name,
    pbrMetallicRoughness: {baseColorFactor: [0.2, 0.4, 0.6, 1], metallicFactor: 0, roughnessFactor: 0.5},
    extensions: {SGD_materials_shifted_gamma: extension},
  })),
});

export async function drawMaterial(page, name, size) {
  return floats(await page.evaluate(async ([gltf, pixels]) => {
    const [material] = await scene.loadMaterials(gltf);
    return scene.draw(material, pixels);
  }, [gltfOf([body(name)]), size]));
}
