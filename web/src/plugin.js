import {MeshSGDMaterial} from './material.js';
import {EXTENSION, ExtensionError, readParameters} from './parameters.js';

/**
 * A plugin of three.js's GLTFLoader: `loader.register(parser => new SGDMaterialsPlugin(parser))`.
 * Materials with SGD_materials_shifted_gamma become MeshSGDMaterial; where the extension is broken
 * or of another version the glTF fit stays, with one warning a file.
 */
export class SGDMaterialsPlugin {
  constructor(parser) {
    this.parser = parser;
    this.name = EXTENSION;
    this.warned = false;
  }

  /** The material, or null for the loader's own. */
  loadMaterial(index) {
    const definition = this.parser.json.materials[index];
    const body = definition.extensions?.[EXTENSION];
    if (body === undefined) return null;
    const parameters = this.read(body, definition.name ?? `materials[${index}]`);
    return parameters && this.build(index, parameters);
  }

  read(body, name) {
    try {
      return readParameters(body);
    } catch (error) {
      if (!(error instanceof ExtensionError)) throw error;
      if (!this.warned) console.warn(`${EXTENSION}: ${name}: ${error.message}. The glTF material is shown instead.`);
      this.warned = true;
      return null;
    }
  }

  async build(index, parameters) {
    const fit = await this.parser.loadMaterial(index);
    if (!fit.isMeshStandardMaterial) return fit;
    const material = new MeshSGDMaterial(parameters, fit);
    this.parser.associations.set(material, {materials: index});
    return material;
  }
}
