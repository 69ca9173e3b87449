// What keys do, wherever the focus is but in a control that uses them itself.

import {KEY_LIGHT, clamp, wrapped} from './settings.js';

/** Keys with what they do to the settings; those without `keys` are gestures. */
export const KEYS = [
  {shown: ['drag'], label: 'turn the subject; two fingers or the wheel zoom'},
  {shown: ['⇧ drag'], label: 'turn the light'},
  {shown: ['←', '→'], keys: {ArrowLeft: -0.02, ArrowRight: 0.02}, label: 'move the line',
    act: (settings, step) => settings.change({split: clamp(settings.split + step, 0, 1)})},
  {shown: ['d'], keys: {d: 1}, label: 'line or difference', act: (settings, step, pictures) => {
    const next = (pictures.indexOf(settings.picture) + step) % pictures.length;
    settings.choosePicture(pictures[next]);
  }},
  {shown: ['s'], keys: {s: 0}, label: 'sun on or off', act: settings => settings.changeSun({on: !settings.sun.on})},
  {shown: [',', '.'], keys: {',': -10, '.': 10}, label: 'turn the light', act: (settings, step) => turnLight(settings, step)},
  {shown: ['−', '+'], keys: {'-': -0.5, '+': 0.5, '=': 0.5}, label: 'exposure',
    act: (settings, step) => settings.change({exposure: clamp(settings.exposure + step, -4, 4)})},
  {shown: ['r'], keys: {r: 0}, label: 'the first view and light', act: (settings, _, __, reset) => {
    settings.change({split: 0.5, exposure: 0, sun: {...settings.sun, ...KEY_LIGHT}, environment: {...settings.environment, turn: 0}});
    reset();
  }},
];

/** Turns sun and environment about the vertical [°], and raises the sun. */
export function turnLight(settings, step, raise = 0) {
  const {sun, environment} = settings;
  settings.change({
    sun: {...sun, azimuth: wrapped(sun.azimuth + step), height: clamp(sun.height + raise, -90, 90)},
    environment: {...environment, turn: wrapped(environment.turn + step)},
  });
}

export function listenToKeys(settings, pictures, reset) {
  addEventListener('keydown', event => {
    if (event.ctrlKey || event.metaKey || event.altKey || usesKeys(event.target, event.key)) return;
    const entry = KEYS.find(({keys}) => keys && event.key in keys);
    if (!entry) return;
    event.preventDefault();
    entry.act(settings, entry.keys[event.key], pictures, reset);
  });
}

/** Sliders, choices and the like keep their arrows. */
const usesKeys = (target, key) => target.matches?.('input, select') && (key.startsWith('Arrow') || target.matches('select'));
