// The command, and the materials it knows.

import {spawnSync} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {fileURLToPath} from 'node:url';

const ROOT = fileURLToPath(new URL('../../', import.meta.url));
export const COMMAND = process.env.SGDBAKE ?? join(ROOT, 'target/release/sgdbake');

/** What the command prints; throws what it says where it fails. */
export function sgdbake(...args) {
  const {status, stdout, stderr, error} = spawnSync(COMMAND, args, {encoding: 'utf8', maxBuffer: 1 << 30});
  if (error) throw error;
  if (status !== 0) throw new Error(`sgdbake ${args.join(' ')}: ${stderr}`);
  return stdout;
}

/** Calls `use` with a folder that is gone afterwards. */
export function withFolder(use) {
  const folder = mkdtempSync(join(tmpdir(), 'sgd-web-'));
  try {
    return use(folder);
  } finally {
    rmSync(folder, {recursive: true, force: true});
  }
}

export const catalogue = () => sgdbake('materials').trim().split('\n').map(line => line.split(/\s/)[0]);

/** The extension's body of a catalogue material: three lobes that colour one channel each. */
export function body(name) {
  const {channels} = JSON.parse(sgdbake('materials', name, '--json'));
  const rgb = ['r', 'g', 'b'].map(key => channels[key]);
  const only = (index, value) => [0, 1, 2].map(channel => (channel === index ? value : 0));
  return {
    version: 2,
    name,
    diffuse: rgb.map(channel => channel.rho_d),
    lobes: rgb.map((channel, index) => ({
      alpha: channel.alpha, p: channel.p, rho_s: only(index, channel.rho_s),
      f0: only(index, channel.f0), f1: only(index, channel.f1),
    })),
  };
}

/** f of each pair of unit directions, [[r, g, b], …]. */
export function evaluate(name, pairs) {
  return withFolder(folder => {
    const file = join(folder, 'pairs.csv');
    const lines = pairs.map(pair => pair.join(','));
    writeFileSync(file, ['wi_x,wi_y,wi_z,wo_x,wo_y,wo_z', ...lines, ''].join('\n'));
    const lines2 = sgdbake('eval', '--material', name, '--pairs', file, '--precision', 'f64', '--json').trim().split('\n');
    return lines2.map(line => {
      const {r, g, b} = JSON.parse(line);
      return [r.brdf, g.brdf, b.brdf];
    });
  });
}

export {readFileSync, ROOT};
