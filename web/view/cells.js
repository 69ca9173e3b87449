// The pictures side by side: a scene is one, of balls each is one.

import {element} from './element.js';
import {Split} from './split.js';

/** How much higher than wide a picture of a ball may be. */
const HIGHEST = 1.06;

export class Cell {
  /**
   * A picture of `object` alone, in its looks: `exact` and `gltf`, or only `measured`. `show(look,
   * sun)` puts one on. `surface` is the stated distance from the measured surface.
   */
  constructor({title, note, surface, object, looks, show, settings}) {
    Object.assign(this, {surface, object, looks, show});
    this.distances = element('span', {className: 'distances'});
    this.caption = element('figcaption', {}, element('strong', {textContent: title}), element('span', {textContent: note}), this.distances);
    this.frame = element('figure', {className: 'cell'}, this.caption);
    this.split = this.compares ? new Split(settings).line : null;
    if (this.split) this.frame.append(this.split);
    this.tell(null);
  }

  get compares() {
    return this.looks.includes('gltf');
  }

  /** Says how far the exact picture is from another, and the material from its surface. */
  tell(mean, from) {
    const parts = [[from === 'measured' ? 'measured' : 'glTF', mean], ['surface', this.surface]]
      .filter(([, distance]) => typeof distance === 'number')
      .flatMap(([to, distance]) => [' ', element('b', {textContent: `${to} ${distance.toFixed(2)}`})]);
    this.distances.replaceChildren(...(parts.length ? ['ΔE2000', ...parts] : []));
  }

  /** Places the cell, in pixels from the upper left of the stage, its caption below the picture. */
  place([left, top, width, height], captionHeight) {
    const room = Math.max(height - captionHeight, 1);
    const picture = captionHeight ? Math.min(room, width * HIGHEST) : room;
    const start = top + (room - picture) / 2;
    this.rectangle = [left, start, width, picture];
    Object.assign(this.frame.style, {left: `${left}px`, top: `${start}px`, width: `${width}px`, height: `${picture}px`});
  }
}

/** Rectangles of `count` equal cells in an area, in as many columns as make their pictures largest. */
export function grid(count, width, height, caption) {
  const side = columns => Math.min(width / columns, height / Math.ceil(count / columns) - caption);
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
