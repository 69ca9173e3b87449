// The panel beside the picture: light, display, materials, keys.

import {segments, slider, toggle} from './controls.js';
import {element} from './element.js';
import {KEYS} from './keys.js';
import {degrees} from './number.js';
import {parametersOf} from './parameters.js';
import {TONES} from './tone.js';

export function fillPanel(panel, {settings, slots, openPanorama, about}) {
  panel.append(
    section('Materials', ...materials(slots, settings)),
    section('Light', ...light(settings, openPanorama)),
    section('Display', ...display(settings)),
    keys(),
    element('p', {className: 'soft about', textContent: about}),
  );
}

const section = (title, ...children) => element('section', {}, element('h2', {textContent: title}), ...children);

/** The slots, and the tables of the chosen one. */
function materials(slots, settings) {
  const buttons = slots.map((slot, index) => slotButton(slot, index, settings));
  const tables = element('div', {className: 'parameters'});
  let shown = null;
  settings.follow(({slot}) => {
    buttons.forEach((button, k) => button.setAttribute('aria-pressed', k === slot));
    if (shown === slot || !slots.length) return;
    shown = slot;
    tables.replaceChildren(...parametersOf(slots[slot]));
  });
  return [element('div', {className: 'slots', role: 'group', ariaLabel: 'Slots'}, ...buttons), tables];
}

function slotButton({name, note, parameters, carries, open}, index, settings) {
  const kind = parameters ? 'exact' : open ? 'show' : carries ? 'fallback' : 'glTF only';
  const button = element('button', {type: 'button'},
    element('span', {textContent: name}),
    element('small', {textContent: note}),
    element('em', {textContent: kind, className: parameters ? 'measured' : ''}));
  button.addEventListener('click', open ?? (() => settings.change({slot: index})));
  return button;
}

function light(settings, openPanorama) {
  const sun = {get: () => settings.sun.on, set: on => settings.changeSun({on}), settings};
  const ofSun = key => ({get: () => settings.sun[key], set: value => settings.changeSun({[key]: value}), show: degrees, step: 1, settings});
  const environments = [['none', 'None'], ['studio', 'Studio'], ['room', 'Room'], ['file', 'File …']];
  const choose = name => {
    if (name !== 'file') return settings.changeEnvironment({name});
    openPanorama();
    // Until there is a file, the environment stays.
    settings.change({});
  };
  return [
    toggle('Sun', sun),
    slider('Direction', {...ofSun('azimuth'), min: -180, max: 180}),
    slider('Height', {...ofSun('height'), min: -90, max: 90}),
    segments('Environment', environments, {get: () => settings.environment.name, set: choose, settings}),
    slider('Turn', {
      get: () => settings.environment.turn, set: turn => settings.changeEnvironment({turn}), show: degrees,
      min: -180, max: 180, step: 1, settings,
    }),
  ];
}

/** What the figures under pictures mean. */
const DIFFERENCES = 'ΔE2000 to glTF and to a measurement are means over the picture as it is now, by sgdbake’s tone curve at this exposure. '
  + 'To the surface, it is the distance that the file states. About 1 is just visible side by side.';

function display(settings) {
  const exposure = slider('Exposure', {
    get: () => settings.exposure, set: value => settings.change({exposure: value}), min: -4, max: 4, step: 0.1, settings,
    show: ev => `${ev > 0 ? '+' : ev < 0 ? '−' : ''}${Math.abs(ev).toFixed(1)} EV`,
  });
  const select = element('select', {}, ...Object.entries(TONES).map(([value, {label}]) => element('option', {value, textContent: label})));
  select.addEventListener('change', () => settings.change({tone: select.value}));
  settings.follow(({tone}) => { select.value = tone; });
  return [exposure, element('label', {className: 'choice'}, element('span', {textContent: 'Tone curve'}), select), element('p', {className: 'soft', textContent: DIFFERENCES})];
}

function keys() {
  const rows = KEYS.map(({shown, label}) => element('div', {}, element('dt', {}, ...shown.map(key => element('kbd', {textContent: key}))), element('dd', {textContent: label})));
  return element('details', {className: 'keys'}, element('summary', {textContent: 'Keys and gestures'}), element('dl', {}, ...rows));
}
