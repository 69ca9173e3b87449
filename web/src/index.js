export {MeshSGDMaterial} from './material.js';
export {EXTENSION, ExtensionError, VERSION, readParameters} from './parameters.js';
export {SGDMaterialsPlugin} from './plugin.js';
