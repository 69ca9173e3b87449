// The parameters of a material, read from a glTF extension or from extras.

export const EXTENSION = 'SGD_materials_shifted_gamma';
export const VERSION = 2;
export const MOST_LOBES = 3;

/** A body that does not describe a material: what was found, and what is accepted. */
export class ExtensionError extends Error {
  name = 'ExtensionError';
}

/** The checked parameters of an extension's body; throws `ExtensionError`. */
export function readParameters(body) {
  if (!isObject(body)) throw new ExtensionError(`expected an object, found ${show(body)}`);
  if (body.version !== VERSION) {
    throw new ExtensionError(`version ${show(body.version)} is unknown; this reader knows version ${VERSION}`);
  }
  if (!Array.isArray(body.lobes) || body.lobes.length > MOST_LOBES) {
    throw new ExtensionError(`lobes: expected an array of at most ${MOST_LOBES}, found ${show(body.lobes)}`);
  }
  return {
    name: typeof body.name === 'string' ? body.name : '',
    diffuse: colour(body, 'diffuse', 'diffuse', 0),
    lobes: body.lobes.map(readLobe),
    error: isObject(body.error) ? body.error : null,
  };
}

function readLobe(lobe, index) {
  const at = `lobes[${index}]`;
  if (!isObject(lobe)) throw new ExtensionError(`${at}: expected an object, found ${show(lobe)}`);
  if (!(Number.isFinite(lobe.alpha) && lobe.alpha > 0)) {
    throw new ExtensionError(`${at}.alpha: expected a number above 0, found ${show(lobe.alpha)}`);
  }
  if (!(Number.isFinite(lobe.p) && lobe.p >= 0)) {
    throw new ExtensionError(`${at}.p: expected a number of at least 0, found ${show(lobe.p)}`);
  }
  return {
    alpha: lobe.alpha,
    p: lobe.p,
    rhoS: colour(lobe, 'rho_s', `${at}.rho_s`, 0),
    f0: colour(lobe, 'f0', `${at}.f0`),
    f1: colour(lobe, 'f1', `${at}.f1`),
  };
}

function colour(holder, key, at, least = -Infinity) {
  const value = holder[key];
  if (Array.isArray(value) && value.length === 3 && value.every(c => Number.isFinite(c) && c >= least)) {
    return [...value];
  }
  const range = least === 0 ? 'three numbers of at least 0' : 'three finite numbers';
  throw new ExtensionError(`${at}: expected ${range}, found ${show(value)}`);
}

const isObject = value => typeof value === 'object' && value !== null && !Array.isArray(value);
const show = value => (value === undefined ? 'nothing' : JSON.stringify(value).slice(0, 80));
