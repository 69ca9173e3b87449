import {DataTexture, FloatType, MeshPhysicalMaterial, MeshStandardMaterial, NearestFilter, RGBAFormat, Vector2, Vector3} from 'three';
import {MASKING_TERMS} from './distribution.js';
import {ROWS, VIEWS, viewScale} from './environment.js';
import {shapeOf} from './lobe.js';
import {patchFragmentShader} from './shader.js';

/**
 * A MeshPhysicalMaterial whose reflection is f = ρd/π + Σ (ρs/π) F D G/(cosθi cosθo) of the Shifted
 * Gamma Distribution. Its own colour, roughness and so on are those of the glTF fit: what a renderer
 * without GLSL shows.
 */
export class MeshSGDMaterial extends MeshPhysicalMaterial {
  /** `parameters` as `readParameters` returns them; `fit` the MeshPhysicalMaterial to extend. */
  constructor(parameters, fit) {
    super();
    this.isMeshSGDMaterial = true;
    if (fit) this.copyFit(fit);
    this.setParameters(parameters ?? {name: '', diffuse: [0, 0, 0], lobes: [], error: null});
  }

  /** Takes what a MeshStandardMaterial or MeshPhysicalMaterial has. */
  copyFit(fit) {
    const {defines} = this;
    const prototype = fit.isMeshPhysicalMaterial ? MeshPhysicalMaterial : MeshStandardMaterial;
    prototype.prototype.copy.call(this, fit);
    this.defines = defines;
  }

  /** Takes another material's reflection; a change of the number of lobes needs a new program. */
  setParameters(parameters) {
    const lobes = parameters.lobes.filter(({rhoS}) => rhoS.some(c => c > 0));
    if (this.lobeCount !== lobes.length) this.needsUpdate = true;
    this.sgdUniforms?.sgdEnvironment?.value.dispose();
    this.parameters = parameters;
    this.lobeCount = lobes.length;
    const values = {sgdDiffuse: new Vector3(...parameters.diffuse), ...(lobes.length && lobeUniforms(lobes))};
    this.sgdUniforms ??= {};
    for (const [name, value] of Object.entries(values)) (this.sgdUniforms[name] ??= {}).value = value;
  }

  onBeforeCompile(shader) {
    Object.assign(shader.uniforms, this.sgdUniforms);
    shader.fragmentShader = patchFragmentShader(shader.fragmentShader, this.lobeCount);
  }

  customProgramCacheKey() {
    return `SGD ${this.lobeCount}`;
  }

  copy(source) {
    super.copy(source);
    this.setParameters(source.parameters);
    return this;
  }

  dispose() {
    this.sgdUniforms.sgdEnvironment?.value.dispose();
    super.dispose();
  }
}

/** The shader's uniforms of lobes. */
function lobeUniforms(lobes) {
  const shapes = lobes.map(({alpha, p}) => shapeOf(alpha, p));
  const vector = VECTORS[lobes.length];
  const colours = of => lobes.map(({rhoS, f0, f1}) => new Vector3(...rhoS.map((rho, c) => rho * of(f0[c], f1[c]))));
  return {
    sgdAlpha: vector(lobes.map(({alpha}) => alpha)),
    sgdP: vector(lobes.map(({p}) => p)),
    sgdPeak: vector(shapes.map(({distribution}) => distribution.peak)),
    sgdScale: vector(shapes.map(({masking}) => masking.scale)),
    sgdStretch: vector(shapes.map(({masking}) => masking.stretch)),
    sgdMasking: Array.from({length: MASKING_TERMS}, (_, k) => vector(shapes.map(({masking}) => masking.coefficients[k]))),
    sgdConstant: colours(f0 => f0),
    sgdSchlick: colours(f0 => 1 - f0),
    sgdCosine: colours((_, f1) => -f1),
    sgdViewScale: shapes.map(({masking}) => viewScale(masking)),
    sgdRoughness: shapes.map(({roughness}) => roughness),
    sgdEnvironment: environmentTexture(shapes),
  };
}

/** A number of each lobe, as GLSL's float, vec2 or vec3. */
const VECTORS = {
  1: ([number]) => number,
  2: numbers => new Vector2(...numbers),
  3: numbers => new Vector3(...numbers),
};

function environmentTexture(shapes) {
  const data = new Float32Array(4 * VIEWS * ROWS * shapes.length);
  shapes.forEach(({table}, j) => data.set(table, j * 4 * VIEWS * ROWS));
  const texture = new DataTexture(data, VIEWS, ROWS * shapes.length, RGBAFormat, FloatType);
  texture.minFilter = texture.magFilter = NearestFilter;
  texture.needsUpdate = true;
  return texture;
}
