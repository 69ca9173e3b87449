// The pictures side by side: a scene is one, of balls each is one.

import {element} from './element.js';
import {Split} from './split.js';

export class Cell {
  /**
   * A picture of `object` alone, in its looks: `exact` and `gltf`, or only `measured`. `show(look,
   * sun)` puts one on.
   */
  constructor({title, note, object, looks, show, settings}) {
    Object.assign(this, {object, looks, show});
    this.mean = element('span', {className: 'mean'});
    const caption = element('figcaption', {}, element('strong', {textContent: title}), element('span', {textContent: note}), this.mean);
    this.frame = element('figure', {className: 'cell'}, caption);
    if (this.compares) this.frame.append(new Split(settings).line);
  }

  get compares() {
    return this.looks.includes('gltf');
  }

  /** Says how far the exact picture is from another. */
  tell(mean, from) {
    const than = from === 'measured' ? 'the measurement' : 'glTF';
    this.mean.textContent = mean === null ? '' : `ΔE2000 ${mean.toFixed(2)} exact to ${than}`;
  }

  /** Places the cell, in pixels of the page from the upper left of the stage. */
  place([left, top, width, height]) {
    this.rectangle = [left, top, width, height];
    Object.assign(this.frame.style, {left: `${left}px`, top: `${top}px`, width: `${width}px`, height: `${height}px`});
  }
}

/** Rectangles of `count` equal cells in an area, in as many columns as make them largest. */
export function grid(count, width, height) {
  const side = columns => Math.min(width / columns, height / Math.ceil(count / columns));
  const choices = Array.from({length: count}, (_, k) => k + 1);
  const columns = choices.reduce((best, choice) => (side(choice) > side(best) ? choice : best));
  const rows = Math.ceil(count / columns);
  return Array.from({length: count}, (_, k) => {
    const row = Math.floor(k / columns);
    const inRow = Math.min(columns, count - row * columns);
    const left = ((columns - inRow) / 2 + k % columns) * width / columns;
    return [left, row * height / rows, width / columns, height / rows];
  });
}
