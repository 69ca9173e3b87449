// The page that `sgdbake view` writes, opened from disk.

import assert from 'node:assert/strict';
import {existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {after, before, test} from 'node:test';
import {pathToFileURL} from 'node:url';
import {page as template} from '../build-view.mjs';
import {deltaE2000} from '../view/colour.js';
import {SCALE, SCALE_END} from '../view/heat.js';
import {openBrowser, openModule} from './chromium.mjs';
import {ROOT, sgdbake} from './sgdbake.mjs';

/** A scene of the shared models, or the built-in ball where they are absent. */
const TEAPOT = join(ROOT, '../shared/models/teapot.obj');
const SIZES = [{width: 1280, height: 800}, {width: 390, height: 844}];
/** Bytes of a page besides its scene. */
const LARGEST = 1.5e6;

let browser, folder;
before(async () => {
  browser = await openBrowser();
  folder = mkdtempSync(join(tmpdir(), 'sgd-view-'));
  // With a measurement a page starts under the sun alone, which software GL is quick at.
  sgdbake('tabulate', '--material', 'gold-paint@refit', '-o', path('gold.binary'), '--quiet');
});
after(async () => {
  await browser.close();
  rmSync(folder, {recursive: true, force: true});
});

const path = name => join(folder, name);

test('the committed template is what its sources build', async () => {
  const committed = readFileSync(join(ROOT, 'src/report/view.html'), 'utf8');
  assert.ok(committed === await template(), 'run: node web/build-view.mjs');
});

test('a scene is drawn as the plugin and the loader draw it', async () => {
  const scene = existsSync(TEAPOT) ? [TEAPOT] : ['--shape', 'ball'];
  sgdbake('export', ...scene, '--assign', '*=gold-paint@refit', '-o', path('scene.glb'));
  sgdbake('view', path('scene.glb'), '-o', path('scene.html'));
  const glb = readFileSync(path('scene.glb')).toString('base64');
  const size = readFileSync(path('scene.html')).length - glb.length;
  console.log(`the page besides its scene: ${size} bytes`);
  assert.ok(size < LARGEST);
  const reference = await openModule(browser.context, 'browser/reference.js', 'reference');
  await withPage('scene.html', async page => {
    await page.evaluate(() => view.settings.change({tone: 'none'}));
    for (const [size, share] of [[SIZES[0], 0.4], [SIZES[1], 0.6]]) {
      await resize(page, size);
      await drag(page, share);
      assert.equal(await page.locator('.split').getAttribute('aria-valuenow'), String(100 * share));
      await assertHalves(page, reference, glb, share);
    }
  });
  await reference.close();
});

test('balls show both editions, and the measurement is the one it was made of', async () => {
  sgdbake('view', '--material', 'gold-paint', '--measured', path('gold.binary'), '-o', path('balls.html'));
  assert.ok(readFileSync(path('balls.html')).length < LARGEST + 0.6e6);
  await withPage('balls.html', async page => {
    const names = await page.locator('figcaption strong').allTextContents();
    assert.deepEqual(names, ['gold-paint', 'gold-paint@refit', 'gold']);
    await page.keyboard.press('d');
    await page.keyboard.press('d');
    for (const size of SIZES) {
      await resize(page, size);
      const [published, refit] = await page.evaluate(() => view.stage.measure());
      console.log(`${size.width} px: published ${published.toFixed(2)}, refit ${refit.toFixed(2)} from the measurement of the refit`);
      assert.ok(refit < 0.1 && published > 4 * refit, `${published}, ${refit}`);
    }
    await assertDifferences(page);
    await assertPanoramas(page);
  });
});

test('a name with markup is only a name', async () => {
  const name = '</script><script>globalThis.broken = true</script><img src=x onerror="globalThis.broken = true">';
  writeFileSync(path('hostile.toml'), `name = '${name}'\nrho_d = [0.1, 0.1, 0.1]\n[[lobe]]\nalpha = 0.1\np = 1.0\nrho_s = [0.1, 0.1, 0.1]\nf0 = [0.04, 0.04, 0.04]\nf1 = [0.0, 0.0, 0.0]\n`);
  sgdbake('view', '--material', path('hostile.toml'), '--measured', path('gold.binary'), '-o', path('hostile.html'));
  await withPage('hostile.html', async page => {
    assert.equal(await page.title(), name);
    assert.equal(await page.locator('h1').textContent(), name);
    assert.equal(await page.evaluate(() => globalThis.broken), undefined);
  });
});

/** Opens a page from disk on a phone; it must ask for nothing and complain of nothing. */
async function withPage(name, use) {
  const page = await browser.context.newPage();
  const [requests, complaints] = [[], []];
  const url = pathToFileURL(path(name)).href;
  page.on('request', request => { if (request.url() !== url && !/^(blob|data):/.test(request.url())) requests.push(request.url()); });
  page.on('console', message => { if (['error', 'warning'].includes(message.type())) complaints.push(message.text()); });
  page.on('pageerror', error => complaints.push(String(error)));
  await page.setViewportSize(SIZES[1]);
  await page.goto(url);
  await page.waitForFunction(() => globalThis.view?.stage.drawn > 0);
  await assertFits(page);
  await use(page);
  await page.close();
  assert.deepEqual({requests, complaints}, {requests: [], complaints: []});
}

/** Makes the window another size; the page draws anew. */
async function resize(page, size) {
  const drawn = await page.evaluate(() => view.stage.drawn);
  await page.setViewportSize(size);
  await page.waitForFunction(before => view.stage.drawn > before, drawn);
  await assertFits(page);
}

async function assertFits(page) {
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth - innerWidth), 0, 'the page is wider than the screen');
}

/** Drags the line to a share of the picture's width. */
async function drag(page, share) {
  const cell = await page.locator('.cell').boundingBox();
  const grip = await page.locator('.split i').boundingBox();
  const y = grip.y + grip.height / 2;
  await page.mouse.move(grip.x + grip.width / 2, y);
  await page.mouse.down();
  await page.mouse.move(cell.x + 0.4 * cell.width, y);
  await page.mouse.move(cell.x + share * cell.width, y);
  await page.mouse.up();
}

/** The colours of differences on the screen are those that colour.js tells. */
async function assertDifferences(page) {
  const pairs = [
    [[0.2, 0.3, 0.1], [0.21, 0.3, 0.1]], [[0.2, 0.2, 0.2], [0.25, 0.25, 0.25]], [[3, 2, 1], [3.2, 2.1, 1]],
    [[0.02, 0.03, 0.3], [0.03, 0.02, 0.3]], [[0.6, 0.1, 0.1], [0.6, 0.12, 0.1]], [[0, 0, 0], [0.004, 0.004, 0.004]],
  ];
  const drawn = await page.evaluate(drawDifferences, pairs);
  pairs.forEach((pair, k) => {
    const expected = heat(deltaE2000(...pair));
    const off = Math.max(...expected.map((c, channel) => Math.abs(c - drawn[k][channel])));
    assert.ok(off <= 3, `${JSON.stringify(pair)}: ${drawn[k]}, not ${expected}`);
  });
}

/** A panorama of the viewer's own lights the balls; what is none leaves a message. */
async function assertPanoramas(page) {
  const chosen = () => page.evaluate(() => [view.settings.environment.name, view.settings.picture]);
  const take = async (name, bytes) => {
    writeFileSync(path(name), bytes);
    await page.locator('input[type=file]').setInputFiles(path(name));
  };
  await take('none.hdr', 'no panorama');
  await page.locator('.message', {hasText: 'none.hdr cannot be read'}).waitFor();
  assert.deepEqual(await chosen(), ['none', 'measured']);
  const white = Buffer.alloc(4 * 4 * 2, Buffer.from([128, 128, 128, 129]));
  await take('white.hdr', Buffer.concat([Buffer.from('#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n'), white]));
  await page.waitForFunction(() => view.settings.environment.name === 'file');
  assert.deepEqual(await chosen(), ['file', 'gltf']);
}

/** Runs in the page: what it shows, base64 of RGBA bytes, and how. */
function look() {
  const {renderer, camera, cells, lights} = view.stage;
  view.stage.draw();
  const gl = renderer.getContext();
  const size = [gl.drawingBufferWidth, gl.drawingBufferHeight];
  const bytes = new Uint8Array(4 * size[0] * size[1]);
  gl.readPixels(0, 0, ...size, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
  let text = '';
  for (let start = 0; start < bytes.length; start += 32768) text += String.fromCharCode(...bytes.subarray(start, start + 32768));
  const {fov, near, far, matrixWorld} = camera;
  return {
    found: btoa(text), size, camera: {fov, near, far, matrix: matrixWorld.toArray()}, origin: cells[0].object.position.toArray(),
    toSun: lights.sun.position.toArray(), irradiance: lights.sun.intensity,
  };
}

/** Runs in the other page. */
const drawReference = ([glb, state]) => reference.draw(glb, state);

/** Runs in the page: the colours on the screen for the differences of even pictures. */
function drawDifferences(pairs) {
  const {renderer, difference, canvas, scene, camera, lights} = view.stage;
  const gl = renderer.getContext();
  const fill = colour => () => {
    const even = new scene.constructor();
    even.background = lights.sun.color.clone().setRGB(...colour);
    renderer.render(even, camera);
  };
  renderer.setViewport(0, 0, canvas.clientWidth, canvas.clientHeight);
  renderer.setScissor(0, 0, canvas.clientWidth, canvas.clientHeight);
  return pairs.map(pair => {
    difference.draw(pair.map(fill), [8, 8], 1);
    const pixel = new Uint8Array(4);
    gl.readPixels(gl.drawingBufferWidth >> 1, gl.drawingBufferHeight >> 1, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    return [...pixel.subarray(0, 3)];
  });
}

/** Compares both sides of the line with pictures of three.js alone, and these with each other. */
async function assertHalves(page, reference, glb, split) {
  const {found, ...state} = await page.evaluate(look);
  const [exact, gltf] = await reference.evaluate(drawReference, [glb, state]);
  const [width, height] = state.size;
  const line = Math.round(split * width);
  const difference = (a, b, from, to) => meanDifference(...[a, b].map(text => Buffer.from(text, 'base64')), width, height, from, to);
  const sides = {exact: difference(found, exact, 0, line - 1), gltf: difference(found, gltf, line + 1, width)};
  const swapped = {exact: difference(found, gltf, 0, line - 1), gltf: difference(found, exact, line + 1, width)};
  console.log(`${width} × ${height}: mean difference of 255: ${JSON.stringify(sides)}, of the other material ${JSON.stringify(swapped)}`);
  for (const side of ['exact', 'gltf']) assert.ok(sides[side] < 0.02 && swapped[side] > 10 * sides[side] + 0.1, side);
}

/** Mean absolute difference of the covered pixels in these columns. */
function meanDifference(a, b, width, height, from, to) {
  let [sum, count] = [0, 0];
  for (let row = 0; row < height; row++) {
    for (let at = 4 * (row * width + from); at < 4 * (row * width + to); at += 4) {
      if (a[at + 3] === 0 && b[at + 3] === 0) continue;
      for (let c = 0; c < 3; c++) sum += Math.abs(a[at + c] - b[at + c]);
      count += 3;
    }
  }
  return sum / count;
}

/** The colour of a difference, 0 to 255. */
function heat(difference) {
  const position = Math.min(difference / SCALE_END, 1) * (SCALE.length - 1);
  const left = Math.min(Math.floor(position), SCALE.length - 2);
  return SCALE[left].map((c, k) => c + (position - left) * (SCALE[left + 1][k] - c));
}
