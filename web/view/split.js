// The line between exact and glTF, which pointers and arrow keys move.

import {element} from './element.js';
import {clamp} from './settings.js';

const KEYS = {ArrowLeft: -0.02, ArrowRight: 0.02, PageDown: -0.2, PageUp: 0.2, Home: -1, End: 1};

export class Split {
  constructor(settings) {
    this.settings = settings;
    this.line = element('div', {
      className: 'split', tabIndex: 0, role: 'slider', 'aria-label': 'Line between exact and glTF',
      'aria-valuemin': 0, 'aria-valuemax': 100, 'aria-orientation': 'horizontal',
    }, element('b', {textContent: 'exact'}), element('i'), element('b', {textContent: 'glTF'}));
    this.line.addEventListener('pointerdown', event => this.#grab(event));
    this.line.addEventListener('pointermove', event => this.#drag(event));
    this.line.addEventListener('keydown', event => this.#step(event));
    settings.follow(({split}) => this.#place(split));
  }

  #place(split) {
    this.line.style.left = `${100 * split}%`;
    this.line.setAttribute('aria-valuenow', Math.round(100 * split));
    this.line.setAttribute('aria-valuetext', `${Math.round(100 * split)} % exact`);
  }

  #grab(event) {
    this.line.setPointerCapture(event.pointerId);
    event.preventDefault();
    this.line.focus({focusVisible: false});
  }

  #drag({pointerId, clientX}) {
    if (!this.line.hasPointerCapture(pointerId)) return;
    const {left, width} = this.line.parentElement.getBoundingClientRect();
    this.settings.change({split: clamp((clientX - left) / width, 0, 1)});
  }

  #step(event) {
    const step = KEYS[event.key];
    if (step === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    this.settings.change({split: clamp(this.settings.split + step, 0, 1)});
  }
}
