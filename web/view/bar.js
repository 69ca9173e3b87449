// The bar under the picture: line or difference, and the scale of differences.

import {segments} from './controls.js';
import {element} from './element.js';
import {SCALE_END, gradient} from './heat.js';

/** The pictures there are, by name. */
export const picturesOf = measured => [
  ['split', 'Exact | glTF'], ['gltf', 'ΔE glTF'], ...(measured ? [['measured', 'ΔE measured']] : []),
];

export function fillBar(bar, settings, pictures) {
  const choice = segments('Picture', pictures, {get: () => settings.picture, set: picture => settings.choosePicture(picture), settings});
  const colours = element('i');
  colours.style.background = gradient();
  const scale = element('div', {className: 'scale'}, element('span', {textContent: 'ΔE2000'}), '0', colours, `${SCALE_END}+`);
  bar.append(choice, scale);
  settings.follow(({picture}) => { scale.hidden = picture === 'split'; });
}
