// A lobe's numbers for the shader, computed once per shape.

import {Masking, ShiftedGamma} from './distribution.js';
import {environmentTable, roughnessOf} from './environment.js';

const shapes = new Map();

/** The distribution, masking and environment table of a shape; equal shapes share one. */
export function shapeOf(alpha, p) {
  const key = `${alpha} ${p}`;
  if (!shapes.has(key)) {
    const distribution = new ShiftedGamma(alpha, p);
    const shape = {distribution, masking: new Masking(distribution)};
    shapes.set(key, {...shape, roughness: roughnessOf(shape), table: environmentTable(shape)});
  }
  return shapes.get(key);
}
