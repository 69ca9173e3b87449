import {DataTexture, FloatType, MeshPhysicalMaterial, MeshStandardMaterial, NearestFilter, RGBAFormat, Vector3} from 'three';
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
    if (this.sgdUniforms?.sgdLobes.value.length !== lobes.length) this.needsUpdate = true;
    this.sgdUniforms?.sgdEnvironment.value?.dispose();
    this.parameters = parameters;
    this.sgdUniforms ??= {sgdDiffuse: {}, sgdLobes: {}, sgdEnvironment: {}};
    this.sgdUniforms.sgdDiffuse.value = new Vector3(...parameters.diffuse);
    this.sgdUniforms.sgdLobes.value = lobes.map(lobeUniforms);
    this.sgdUniforms.sgdEnvironment.value = environmentTexture(lobes);
  }

  onBeforeCompile(shader) {
    Object.assign(shader.uniforms, this.sgdUniforms);
    shader.fragmentShader = patchFragmentShader(shader.fragmentShader, this.sgdUniforms.sgdLobes.value.length);
  }

  customProgramCacheKey() {
    return `SGD ${this.sgdUniforms.sgdLobes.value.length}`;
  }

  copy(source) {
    super.copy(source);
    this.setParameters(source.parameters);
    return this;
  }

  dispose() {
    this.sgdUniforms.sgdEnvironment.value?.dispose();
    super.dispose();
  }
}

function lobeUniforms({alpha, p, rhoS, f0, f1}) {
  const {distribution, masking, roughness} = shapeOf(alpha, p);
  return {
    rhoS: new Vector3(...rhoS),
    f0: new Vector3(...f0),
    f1: new Vector3(...f1),
    alpha,
    p,
    peak: distribution.peak,
    scale: masking.scale,
    stretch: masking.stretch,
    viewScale: viewScale(masking),
    roughness,
    masking: masking.coefficients,
  };
}

function environmentTexture(lobes) {
  if (lobes.length === 0) return null;
  const data = new Float32Array(4 * VIEWS * ROWS * lobes.length);
  lobes.forEach(({alpha, p}, j) => data.set(shapeOf(alpha, p).table, j * 4 * VIEWS * ROWS));
  const texture = new DataTexture(data, VIEWS, ROWS * lobes.length, RGBAFormat, FloatType);
  texture.minFilter = texture.magFilter = NearestFilter;
  texture.needsUpdate = true;
  return texture;
}
