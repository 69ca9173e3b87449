import type {MeshPhysicalMaterial, MeshStandardMaterial} from 'three';
import type {GLTFLoaderPlugin, GLTFParser} from 'three/addons/loaders/GLTFLoader.js';

/** Linear RGB. */
export type Colour = [number, number, number];

/** A lobe of the Shifted Gamma Distribution that colours all channels. */
export interface SGDLobe {
  /** The width α > 0, of the order of a squared Beckmann width. */
  alpha: number;
  /** The exponent p ≥ 0 of the power factor; 0 is Beckmann's distribution of width √α. */
  p: number;
  /** The specular scale ρs ≥ 0. */
  rhoS: Colour;
  /** F = f0 + (1 − f0)(1 − cosθd)⁵ − f1 cosθd. */
  f0: Colour;
  f1: Colour;
}

/** f = ρd/π + Σ (ρs/π) F D G/(cosθi cosθo) over at most three lobes. */
export interface SGDParameters {
  name: string;
  /** The diffuse albedo ρd. */
  diffuse: Colour;
  lobes: SGDLobe[];
  /** The stated distance from the measurement, where the file has one. */
  error: {delta_e: number; source: string} | null;
}

/** The name of the glTF extension. */
export const EXTENSION: 'SGD_materials_shifted_gamma';

/** The version of the extension that is read. */
export const VERSION: 2;

/** A body that does not describe a material. */
export class ExtensionError extends Error {}

/** The checked parameters of an extension's body; throws `ExtensionError`. */
export function readParameters(body: unknown): SGDParameters;

/**
 * A MeshPhysicalMaterial that reflects as measured. Its textures, alpha, sides and so on are its
 * own; its colour, roughness and coat are those of the glTF fit, which a renderer without GLSL
 * (WebGPURenderer) shows. Textures, vertex and instance colours tint the reflection.
 */
export class MeshSGDMaterial extends MeshPhysicalMaterial {
  constructor(parameters?: SGDParameters, fit?: MeshStandardMaterial);
  readonly isMeshSGDMaterial: true;
  readonly parameters: SGDParameters;
  /** Takes another measured reflection. */
  setParameters(parameters: SGDParameters): void;
}

/**
 * A plugin of GLTFLoader: `loader.register(parser => new SGDMaterialsPlugin(parser))`. Where the
 * extension is broken or of another version, the glTF fit stays, with one warning a file.
 */
export class SGDMaterialsPlugin implements GLTFLoaderPlugin {
  constructor(parser: GLTFParser);
  readonly name: string;
  loadMaterial(index: number): Promise<MeshStandardMaterial> | null;
}
