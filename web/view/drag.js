// ⇧ drag on the picture turns the light.

import {turnLight} from './keys.js';

/** Degrees a pixel. */
const SPEED = 0.5;

export function dragLight(stage, canvas, settings) {
  let last = null;
  stage.addEventListener('pointerdown', event => {
    if (!event.shiftKey || event.target !== canvas) return;
    event.stopPropagation();
    canvas.setPointerCapture(event.pointerId);
    last = event;
  }, {capture: true});
  stage.addEventListener('pointermove', event => {
    if (!last) return;
    event.stopPropagation();
    turnLight(settings, SPEED * (event.clientX - last.clientX), SPEED * (last.clientY - event.clientY));
    last = event;
  }, {capture: true});
  for (const end of ['pointerup', 'pointercancel']) stage.addEventListener(end, () => { last = null; }, {capture: true});
}
