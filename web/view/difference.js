// The ΔE2000 of two pictures: as colours on the screen, and as a mean.

import {DataUtils, HalfFloatType, Mesh, OrthographicCamera, PlaneGeometry, Scene, ShaderMaterial, WebGLRenderTarget} from 'three';
import {deltaE2000} from './colour.js';
import {fragmentShader, vertexShader} from './difference.glsl.js';

/** Pixels along the longer side of the pictures that means are taken of. */
const SIDE = 112;

export class Difference {
  #targets = [0, 1].map(() => new WebGLRenderTarget(1, 1, {type: HalfFloatType, samples: 4}));
  #uniforms = {first: {value: this.#targets[0].texture}, second: {value: this.#targets[1].texture}, exposure: {value: 1}};
  #camera = new OrthographicCamera();

  constructor(renderer) {
    this.renderer = renderer;
    const material = new ShaderMaterial({
      vertexShader, fragmentShader, uniforms: this.#uniforms, depthTest: false, transparent: true, toneMapped: false,
    });
    const quad = new Mesh(new PlaneGeometry(2, 2), material);
    quad.frustumCulled = false;
    this.scene = new Scene().add(quad);
  }

  /** Draws the difference of what two functions draw, `width` × `height` pixels, to the viewport. */
  draw(pictures, [width, height], exposure) {
    this.#render(pictures, Math.max(Math.round(width), 1), Math.max(Math.round(height), 1));
    this.#uniforms.exposure.value = exposure;
    this.renderer.render(this.scene, this.#camera);
  }

  /** The mean over the pixels that both pictures cover; null where there are none. */
  mean(pictures, [width, height], exposure) {
    const scale = SIDE / Math.max(width, height);
    const size = [width, height].map(side => Math.max(Math.round(side * scale), 1));
    this.#render(pictures, ...size);
    const [first, second] = this.#targets.map(target => this.#read(target, size));
    let [sum, count] = [0, 0];
    for (let k = 0; k < first.length; k += 4) {
      if (first[k + 3] < 0.99 || second[k + 3] < 0.99) continue;
      const scene = picture => [picture[k], picture[k + 1], picture[k + 2]].map(c => exposure * c);
      sum += deltaE2000(scene(first), scene(second));
      count++;
    }
    return count ? sum / count : null;
  }

  #render(pictures, width, height) {
    const {renderer} = this;
    pictures.forEach((draw, k) => {
      this.#targets[k].setSize(width, height);
      renderer.setRenderTarget(this.#targets[k]);
      draw();
    });
    renderer.setRenderTarget(null);
  }

  #read(target, [width, height]) {
    const halves = new Uint16Array(4 * width * height);
    this.renderer.readRenderTargetPixels(target, 0, 0, width, height, halves);
    return Float32Array.from(halves, DataUtils.fromHalfFloat);
  }
}
