// What of our data in `before` is still in `after`, one word or phrase for each kind.
import { execFileSync } from "node:child_process";
import { open, view } from "./glb.mjs";

const EXTENSION = "SGD_materials_shifted_gamma";
const [SPECULAR, CLEARCOAT] = ["KHR_materials_specular", "KHR_materials_clearcoat"];

// Larger relative differences are another value, not another number format.
const ROUNDING = 1e-5;

/** Compares a scene with these materials before and after a tool; `sgdbake` is the binary that restores. */
export function kept(before, after, materials, sgdbake) {
  const [old, now] = [open(before), open(after)];
  const pairs = old.json.materials.filter(hasExtras).map((material) => [material, find(now.json.materials ?? [], material) ?? {}]);
  return {
    factors: worst(pairs.map(([a, b]) => factors(a, b))),
    extensions: worst(pairs.map(([a, b]) => extensions(a, b))),
    extension: worst(pairs.map(([a, b]) => extension(a, b))),
    textures: worst(pairs.map(([a, b]) => textures(old, a, now, b))),
    extras: worst(pairs.map(([a, b]) => difference(a.extras.sgd, b.extras?.sgd))),
    restore: restored(after, materials, sgdbake),
  };
}

const hasExtras = (material) => material.extras?.sgd !== undefined;
const find = (materials, { name, extras }) =>
  materials.find((material) => material.name === name) ?? materials.find((material) => material.extras?.sgd?.name === extras.sgd.name);

const ORDER = ["dropped", "stale", "in a texture", "changed"];
/** The worst of the materials' states: dropped before changed before rounded before kept. */
function worst(states) {
  const rank = (state) => (ORDER.includes(state) ? ORDER.indexOf(state) : state === "kept" ? Infinity : ORDER.length - parseFloat(state.split(" ").at(-1)));
  const [first] = states.toSorted((a, b) => rank(a) - rank(b));
  return new Set(states).size > 1 && first === "dropped" ? "dropped in part" : first;
}

function factors(before, after) {
  const [a, b] = [before, after].map(({ pbrMetallicRoughness: m = {} }) => [
    m.baseColorFactor ?? [1, 1, 1, 1], m.metallicFactor ?? 1, m.roughnessFactor ?? 1,
  ]);
  if (after.pbrMetallicRoughness?.baseColorTexture) return "in a texture";
  return difference(a, b);
}

const DEFAULTS = {
  [SPECULAR]: { specularFactor: 1, specularColorFactor: [1, 1, 1] },
  [CLEARCOAT]: { clearcoatFactor: 0, clearcoatRoughnessFactor: 0 },
};

function extensions(before, after) {
  const names = [SPECULAR, CLEARCOAT].filter((name) => before.extensions[name]);
  if (names.length > 0 && !names.some((name) => after.extensions?.[name])) return "dropped";
  const of = (material) => names.map((name) => ({ ...DEFAULTS[name], ...material.extensions?.[name] }));
  return difference(of(before), of(after));
}

/** The extension apart from its textures and its mark. */
function extension(before, after) {
  const parameters = (material) => {
    const { textures, document, ...rest } = material.extensions?.[EXTENSION] ?? {};
    return rest;
  };
  return after.extensions?.[EXTENSION] ? difference(parameters(before), parameters(after)) : "dropped";
}

/** Whether the buffer views that the extension names hold its textures. */
function textures(old, before, now, after) {
  const body = after.extensions?.[EXTENSION];
  if (!body) return "dropped";
  const bytes = (file, { bufferView }) => view(file, bufferView) ?? Buffer.alloc(0);
  const same = body.textures.every((texture, i) => bytes(now, texture).equals(bytes(old, before.extensions[EXTENSION].textures[i])));
  return same ? "kept" : "stale";
}

/** "kept", "dropped", "changed", or "kept to" the largest relative difference of two numbers. */
function difference(a, b) {
  const largest = distance(a, b);
  if (largest === 0) return "kept";
  if (b === undefined) return "dropped";
  return largest > ROUNDING ? "changed" : `kept to ${largest.toExponential(0)}`;
}

function distance(a, b) {
  if (typeof a === "number" && typeof b === "number") return a === b ? 0 : Math.abs(a - b) / Math.max(Math.abs(a), Math.abs(b));
  if (a === null || typeof a !== "object") return a === b ? 0 : Infinity;
  if (b === null || typeof b !== "object" || Array.isArray(a) !== Array.isArray(b)) return Infinity;
  const keys = [...new Set([...Object.keys(a), ...Object.keys(b)])];
  return Math.max(0, ...keys.map((key) => distance(a[key], b[key])));
}

/**
 * What `sgdbake restore` makes of the scene, against an export of the same materials into it. (Against `before` it could
 * not be compared byte for byte: a tool may change the order of materials, which is that of the textures' rows.)
 */
function restored(after, materials, sgdbake) {
  const [target, fresh] = ["restored", "exported"].map((name) => after.replace(/\.glb$/, `-${name}.glb`));
  const run = (...line) => execFileSync(sgdbake, ["--quiet", ...line], { stdio: ["ignore", "pipe", "pipe"], encoding: "utf8" });
  let report;
  try {
    report = JSON.parse(run("restore", after, "-o", target, "--json"));
  } catch (error) {
    if (error.status === 1 && error.stderr.includes("no material has extras.sgd")) return "no";
    throw error;
  }
  // By index: a tool may rename materials.
  const found = report.materials.filter(({ restored }) => restored);
  const slots = Object.fromEntries(found.map(({ index, restored }) => [`#${index}`, restored]));
  if (Object.values(slots).sort().join() !== Object.values(materials).sort().join()) return `only ${Object.values(slots).join(", ")}`;
  run("export", after, "-o", fresh, ...assignments(slots));
  const [old, now] = [open(fresh), open(target)];
  const pairs = found.map(({ index }) => [old.json.materials[index], now.json.materials[index]]);
  const states = [worst(pairs.map(([a, b]) => extension(a, b))), worst(pairs.map(([a, b]) => textures(old, a, now, b)))];
  return states.every((state) => state === "kept") ? "yes" : `parameters ${states[0]}, textures ${states[1]}`;
}

/** The options that put these materials into the slots of these names. */
export const assignments = (materials) => Object.entries(materials).flatMap(([slot, material]) => ["--assign", `${slot}=${material}`]);
