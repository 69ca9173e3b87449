// Controls of the panel, each bound to a setting.

import {element} from './element.js';

/** A choice of one, side by side. `options` are [value, label]. */
export function segments(legend, options, {get, set, settings}) {
  const name = `s-${legend.toLowerCase().replace(/\W/g, '-')}`;
  const inputs = options.map(([value]) => element('input', {type: 'radio', name, value}));
  const labels = options.map(([, label], k) => element('label', {}, inputs[k], element('span', {textContent: label})));
  const fieldset = element('fieldset', {className: 'segments'}, element('legend', {textContent: legend}), ...labels);
  fieldset.addEventListener('change', ({target}) => set(target.value));
  settings.follow(() => { for (const input of inputs) input.checked = input.value === get(); });
  return fieldset;
}

/** A slider with its value in words. */
export function slider(label, {min, max, step, get, set, show, settings}) {
  const input = element('input', {type: 'range', min, max, step, 'aria-label': label});
  const value = element('output');
  input.addEventListener('input', () => set(Number(input.value)));
  settings.follow(() => {
    input.value = get();
    input.style.setProperty('--share', (get() - min) / (max - min));
    value.textContent = show(get());
  });
  return element('label', {className: 'slider'}, element('span', {textContent: label}), value, input);
}

/** An on-off switch. */
export function toggle(label, {get, set, settings}) {
  const input = element('input', {type: 'checkbox', role: 'switch'});
  input.addEventListener('change', () => set(input.checked));
  settings.follow(() => { input.checked = get(); });
  return element('label', {className: 'toggle'}, element('span', {textContent: label}), input);
}
