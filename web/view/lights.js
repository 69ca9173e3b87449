// The sun and the environment.

import {DirectionalLight, PMREMGenerator} from 'three';
import {RoomEnvironment} from 'three/addons/environments/RoomEnvironment.js';
import {HDRLoader} from 'three/addons/loaders/HDRLoader.js';
import {panorama, studio} from './studio.js';

const DEGREE = Math.PI / 180;

/** Unit direction to a light at `azimuth` from the front and `height` above the horizon [°]. */
export function direction({azimuth, height}) {
  const [a, h] = [azimuth * DEGREE, height * DEGREE];
  return [Math.cos(h) * Math.sin(a), Math.sin(h), Math.cos(h) * Math.cos(a)];
}

export class Lights {
  /** Environments by name, prefiltered when first asked for. */
  #maps = new Map();
  #makers = {
    none: () => null,
    studio: generator => generator.fromEquirectangular(studio()).texture,
    room: generator => generator.fromScene(new RoomEnvironment(), 0.04).texture,
  };

  constructor(renderer, scene) {
    this.renderer = renderer;
    this.scene = scene;
    // A white diffuse surface that faces it shows as 1.
    this.sun = new DirectionalLight(0xffffff, Math.PI);
    scene.add(this.sun);
  }

  /** Sets the lights as chosen. */
  set({sun, environment}) {
    this.sun.visible = sun.on;
    this.sun.position.set(...direction(sun));
    this.scene.environment = this.#map(environment.name);
    this.scene.environmentRotation.y = environment.turn * DEGREE;
  }

  #map(name) {
    if (!this.#maps.has(name)) this.#maps.set(name, this.#makers[name]?.(this.#generator()) ?? null);
    return this.#maps.get(name);
  }

  #generator() {
    return new PMREMGenerator(this.renderer);
  }

  /** Takes a Radiance panorama as the environment `file`; throws where it is none. */
  take(buffer) {
    const loader = new HDRLoader();
    const {data, width, height} = loader.parse(buffer);
    const texture = panorama(data, width, height, loader.type);
    texture.flipY = true;
    this.#maps.set('file', this.#generator().fromEquirectangular(texture).texture);
    texture.dispose();
  }
}
