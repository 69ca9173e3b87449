// The command, and the materials it knows.

import {spawnSync} from 'node:child_process';
import {mkdtempSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {fileURLToPath} from 'node:url';

export const ROOT = fileURLToPath(new URL('../../', import.meta.url));
const COMMAND = process.env.SGDBAKE ?? join(ROOT, 'target/release/sgdbake');

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

/** The extension's body of a material, from what `sgdbake materials` prints of it. */
export function body(name) {
  const {channels, diffuse, lobes} = JSON.parse(sgdbake('materials', name, '--json'));
  return {version: 2, name, ...(channels ? separateLobes(channels) : {diffuse, lobes})};
}

/** A published fit: three lobes that colour one channel each. */
function separateLobes(channels) {
  const rgb = ['r', 'g', 'b'].map(key => channels[key]);
  const only = (index, value) => [0, 1, 2].map(channel => (channel === index ? value : 0));
  return {
    diffuse: rgb.map(({rho_d}) => rho_d),
    lobes: rgb.map(({alpha, p, rho_s, f0, f1}, index) => ({
      alpha, p, rho_s: only(index, rho_s), f0: only(index, f0), f1: only(index, f1),
    })),
  };
}

/** f of pairs of directions, [wi, wo] each of three numbers: [[r, g, b], …]. */
export function evaluate(name, pairs) {
  return withFolder(folder => {
    const file = join(folder, 'pairs.csv');
    writeFileSync(file, `wi_x,wi_y,wi_z,wo_x,wo_y,wo_z\n${pairs.map(pair => pair.flat().join(',')).join('\n')}\n`);
    const lines = sgdbake('eval', '--material', name, '--pairs', file, '--precision', 'f64', '--json');
    return lines.trim().split('\n').map(line => {
      const {r, g, b} = JSON.parse(line);
      return [r.brdf, g.brdf, b.brdf];
    });
  });
}
