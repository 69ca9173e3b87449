// Bundles view/ into the page that `sgdbake view` fills: node build-view.mjs [FILE]

import {readFileSync, writeFileSync} from 'node:fs';
import {fileURLToPath} from 'node:url';
import {build, transform} from 'esbuild';

const at = path => fileURLToPath(new URL(path, import.meta.url));

/** What the licence of the bundled code asks for. */
const NOTICE = `/*!
three.js, and in it meshoptimizer's decoder (Copyright (c) 2016-2026, Arseny Kapoulkine):
${readFileSync(at('node_modules/three/LICENSE'), 'utf8').trim()}
*/`;

/** The page, with %GENERATOR%, %TITLE%, %CONTENTS%, %SCENE% and %MEASUREMENT% left to fill. */
export async function page() {
  const {outputFiles: [bundle]} = await build({
    entryPoints: [at('view/main.js')], bundle: true, minify: true, write: false, format: 'iife', target: 'es2022',
    legalComments: 'none', absWorkingDir: at('.'), banner: {js: NOTICE},
  });
  const style = await transform(readFileSync(at('view/style.css'), 'utf8'), {loader: 'css', minify: true});
  const filled = {STYLE: style.code.trim(), SCRIPT: bundle.text.trim()};
  return readFileSync(at('view/index.html'), 'utf8').replace(/%(STYLE|SCRIPT)%/g, (_, name) => filled[name]);
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  writeFileSync(process.argv[2] ?? at('../src/report/view.html'), await page());
}
