// The tables of one slot: the measured material, its stated error, the glTF material.

import {element} from './element.js';
import {short} from './number.js';

/** What there is to tell of a slot. */
export function parametersOf({parameters, gltf, carries}) {
  if (!parameters) return [note(carries), ...fitOf(gltf)];
  return [statedError(parameters.error), table(parameters), ...fitOf(gltf)];
}

const note = carries => element('p', {
  className: 'soft',
  textContent: carries
    ? 'The extension cannot be read here, or nothing is drawn with it: the glTF material is shown on both sides.'
    : 'Plain glTF: both sides of the line show the same.',
});

function statedError(error) {
  if (typeof error?.delta_e !== 'number') return element('p', {className: 'soft', textContent: 'No stated distance from a measurement.'});
  return element('p', {className: 'stated'},
    element('strong', {textContent: error.delta_e.toFixed(2)}),
    element('span', {textContent: `ΔE2000 from the measured surface, as the file states it${error.source ? ` (${error.source})` : ''}`}));
}

const CHANNELS = ['red', 'green', 'blue'];

function table({diffuse, lobes}) {
  const separate = lobes.length === 3 && lobes.every(({rhoS}, lobe) => rhoS.every((c, channel) => channel === lobe || c === 0));
  const rows = separate ? separateRows(lobes) : lobes.flatMap(jointRows);
  const head = element('tr', {}, element('td', {}, swatch(diffuse)), ...CHANNELS.map(name => element('th', {scope: 'col', textContent: name})));
  return element('table', {}, element('thead', {}, head), element('tbody', {}, row('ρd diffuse', diffuse), ...rows));
}

/** A lobe a channel: its own part of each colour. */
function separateRows(lobes) {
  const own = key => lobes.map((lobe, channel) => lobe[key][channel]);
  return [
    row('α width', lobes.map(({alpha}) => alpha)), row('p tail', lobes.map(({p}) => p)),
    row('ρs specular', own('rhoS')), row('F0', own('f0')), row('F1', own('f1')),
  ];
}

function jointRows({alpha, p, rhoS, f0, f1}, index) {
  const head = element('th', {colSpan: 4, scope: 'rowgroup'},
    `Lobe ${index + 1}`, element('span', {textContent: `α ${short(alpha)}`}), element('span', {textContent: `p ${short(p)}`}));
  return [element('tr', {className: 'lobe'}, head), row('ρs specular', rhoS), row('F0', f0), row('F1', f1)];
}

const row = (name, numbers) =>
  element('tr', {}, element('th', {scope: 'row', textContent: name}), ...numbers.map(x => element('td', {textContent: short(x).replace(/^-/, '−')})));

/** A dot of a linear colour. */
export function swatch(linear) {
  const encoded = linear.map(c => 255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055)).map(c => Math.min(Math.max(Math.round(c), 0), 255));
  const dot = element('i', {className: 'swatch'});
  dot.style.background = `rgb(${encoded.join(' ')})`;
  return dot;
}

function fitOf(gltf) {
  if (!gltf?.color) return [];
  const parts = [['roughness', gltf.roughness], ['metallic', gltf.metalness], ['specular', gltf.specularIntensity], ['coat', gltf.clearcoat]];
  const text = parts.filter(([, x]) => typeof x === 'number').map(([name, x]) => `${name} ${short(x)}`).join(' · ');
  return [element('p', {className: 'fit'}, swatch(gltf.color.toArray()), element('span', {}, element('b', {textContent: 'glTF '}), text))];
}
