// The canvas: draws the cells, one camera for all.

import {PerspectiveCamera, Scene, Vector3, WebGLRenderer} from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';
import {grid} from './cells.js';
import {Difference} from './difference.js';
import {Lights, direction} from './lights.js';
import {TONES} from './tone.js';

/** Milliseconds of rest after which means are taken. */
const REST = 180;

/** How much of a picture's smaller side the subject fills. */
const FILL = 0.9;

export class Stage {
  #waiting = false;

  /** `margins` tells the pixels above and below the cells. */
  constructor(canvas, settings, cells, margins) {
    Object.assign(this, {canvas, settings, cells, margins});
    this.renderer = new WebGLRenderer({canvas, antialias: true, alpha: true});
    this.renderer.setClearColor(0, 0);
    this.renderer.setScissorTest(true);
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(24, 1, 0.1, 100);
    this.lights = new Lights(this.renderer, this.scene);
    this.difference = new Difference(this.renderer);
    this.orbit = new OrbitControls(this.camera, canvas);
    Object.assign(this.orbit, {rotateSpeed: 0.9, zoomSpeed: 0.8});
    this.orbit.addEventListener('change', () => this.redraw());
    const observer = new ResizeObserver(() => this.#resize());
    for (const part of canvas.parentElement.children) observer.observe(part);
    settings.addEventListener('change', () => this.redraw());
    for (const cell of cells) this.scene.add(cell.object);
  }

  /** Looks at a sphere of this radius about the origin. */
  frame(radius, from) {
    this.view = {radius, from: new Vector3(...from).normalize()};
    this.#resize();
    this.reset();
  }

  /** The first view again. */
  reset() {
    const {radius, from} = this.view;
    const half = Math.atan(Math.tan(this.camera.fov * Math.PI / 360) * FILL * Math.min(this.camera.aspect, 1));
    const distance = radius / Math.sin(half);
    Object.assign(this.camera, {near: distance / 100, far: distance * 20});
    Object.assign(this.orbit, {minDistance: radius * 1.15, maxDistance: distance * 6});
    this.camera.position.copy(from).multiplyScalar(distance);
    this.camera.updateProjectionMatrix();
    this.orbit.target.set(0, 0, 0);
    this.orbit.update();
    this.redraw();
  }

  #resize() {
    const {clientWidth: width, clientHeight: height} = this.canvas.parentElement;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.#place(width, height);
    const [, , cellWidth, cellHeight] = this.cells[0].rectangle;
    this.camera.aspect = cellWidth / cellHeight;
    this.camera.updateProjectionMatrix();
    this.redraw();
  }

  /** Places the cells, twice: how high captions are depends on how wide the cells are. */
  #place(width, height) {
    const {top, bottom} = this.margins();
    let caption = 0;
    for (let round = 0; round < 2; round++) {
      grid(this.cells.length, width, Math.max(height - top - bottom, 1), caption)
        .forEach(([left, y, w, h], k) => this.cells[k].place([left, y + top, w, h], caption));
      if (this.cells.length > 1) caption = Math.max(...this.cells.map(cell => cell.caption.offsetHeight));
    }
  }

  /** Draws with the next frame. */
  redraw() {
    if (this.#waiting) return;
    this.#waiting = true;
    requestAnimationFrame(() => {
      this.#waiting = false;
      this.draw();
    });
    clearTimeout(this.rest);
    this.rest = setTimeout(() => this.measure(), REST);
  }

  draw() {
    const {renderer, settings} = this;
    this.lights.set(settings);
    renderer.toneMapping = TONES[settings.tone].curve;
    renderer.toneMappingExposure = 2 ** settings.exposure;
    this.#viewport([0, 0, this.canvas.clientWidth, this.canvas.clientHeight]);
    renderer.clear();
    for (const cell of this.cells) this.#drawCell(cell);
    this.drawn = (this.drawn ?? 0) + 1;
  }

  #drawCell(cell) {
    const [left, top, width, height] = cell.rectangle;
    const other = this.compared(cell);
    this.#viewport(cell.rectangle);
    if (other && this.settings.picture !== 'split') {
      const scale = this.renderer.getPixelRatio();
      this.difference.draw(this.#pair(cell, other), [scale * width, scale * height], 2 ** this.settings.exposure);
      return;
    }
    const exact = cell.compares ? Math.round(width * this.settings.split) : width;
    this.#scissor([left, top, exact, height]);
    this.#render(cell, cell.looks[0]);
    if (exact === width) return;
    this.#scissor([left + exact, top, width - exact, height]);
    this.#render(cell, 'gltf');
  }

  /** What the exact picture of a cell is compared with: [cell, look], or null. */
  compared(cell) {
    if (!cell.compares) return null;
    if (this.settings.picture !== 'measured') return [cell, 'gltf'];
    return [this.cells.find(({looks}) => looks[0] === 'measured'), 'measured'];
  }

  #pair(cell, [other, look]) {
    return [() => this.#render(cell, 'exact'), () => this.#render(other, look)];
  }

  #render(cell, look) {
    for (const {object} of this.cells) object.visible = false;
    cell.object.visible = true;
    cell.show(look, this.#sun());
    this.renderer.render(this.scene, this.camera);
  }

  #sun() {
    return {toSun: direction(this.settings.sun), irradiance: this.lights.sun.intensity};
  }

  /** Says the means of all cells that compare, and returns them. */
  measure() {
    return this.cells.filter(cell => cell.compares).map(cell => {
      const other = this.compared(cell);
      const [, , width, height] = cell.rectangle;
      const mean = this.difference.mean(this.#pair(cell, other), [width, height], 2 ** this.settings.exposure);
      cell.tell(mean, other[1]);
      return mean;
    });
  }

  #viewport(rectangle) {
    this.renderer.setViewport(...this.#fromBottom(rectangle));
    this.#scissor(rectangle);
  }

  #scissor(rectangle) {
    this.renderer.setScissor(...this.#fromBottom(rectangle));
  }

  #fromBottom([left, top, width, height]) {
    return [left, this.canvas.clientHeight - top - height, width, height];
  }
}
