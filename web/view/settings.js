// What the viewer has chosen, and who wants to know.

/** sgdbake's key light: from the upper left, 45° off the line of sight. */
export const KEY_LIGHT = {azimuth: -35.3, height: 30};

export class Settings extends EventTarget {
  picture = 'split';
  split = 0.5;
  sun = {on: true, ...KEY_LIGHT};
  environment = {name: 'studio', turn: 0};
  exposure = 0;
  tone = 'sgdbake';
  slot = 0;

  /** Takes other values and says so. */
  change(values) {
    Object.assign(this, values);
    this.dispatchEvent(new Event('change'));
  }

  changeSun(values) {
    this.change({sun: {...this.sun, ...values}});
  }

  /** Takes another environment; a measurement is compared under the sun alone. */
  changeEnvironment(values) {
    const environment = {...this.environment, ...values};
    const leaves = this.picture === 'measured' && environment.name !== 'none';
    this.change({environment, ...(leaves && {picture: 'gltf'})});
  }

  choosePicture(picture) {
    const alone = {sun: {...this.sun, on: true}, environment: {...this.environment, name: 'none'}};
    this.change({picture, ...(picture === 'measured' && alone)});
  }

  /** Calls `use` now and after every change. */
  follow(use) {
    this.addEventListener('change', () => use(this));
    use(this);
  }
}

/** An angle in [−180, 180). */
export const wrapped = degrees => degrees - 360 * Math.floor((degrees + 180) / 360);

export const clamp = (x, low, high) => Math.min(Math.max(x, low), high);
