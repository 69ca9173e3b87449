// Headless Chromium with software GL, and a page that runs a module of this folder.

import {mkdtemp, rm} from 'node:fs/promises';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {fileURLToPath} from 'node:url';
import {build} from 'esbuild';
import {chromium} from 'playwright-core';

const FLAGS = ['--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking',
  '--disable-component-update', '--disable-sync', '--use-gl=angle', '--use-angle=swiftshader',
  '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'];

/** Opens Chromium; `close` ends it and removes its profile. */
export async function openBrowser(options = {}) {
  const profile = await mkdtemp(join(tmpdir(), 'sgd-web-'));
  const context = await chromium.launchPersistentContext(profile, {
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium', headless: true, args: FLAGS, ...options,
  });
  const close = async () => {
    await context.close();
    await rm(profile, {recursive: true, force: true});
  };
  return {context, close};
}

/** A page in which `module`, a path below this folder, is the global `name`. */
export async function openModule(context, module, name) {
  const entry = fileURLToPath(new URL(module, import.meta.url));
  const {outputFiles: [bundle]} = await build({
    entryPoints: [entry], bundle: true, write: false, format: 'iife', globalName: name, target: 'es2022',
  });
  const page = await context.newPage();
  page.on('console', message => { if (message.type() === 'error') console.error(`page: ${message.text()}`); });
  page.on('pageerror', error => console.error(`page: ${error}`));
  await page.addScriptTag({content: bundle.text});
  return page;
}

