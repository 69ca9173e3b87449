// What sgdbake wrote into the page.

const text = id => document.getElementById(id).textContent;

/** The bytes of a base64 text. */
function bytes(base64) {
  const binary = atob(base64);
  const array = new Uint8Array(binary.length);
  for (let k = 0; k < binary.length; k++) array[k] = binary.charCodeAt(k);
  return array;
}

/** The title, the kind of page, its balls and what is known of its measurement. */
export const readContents = () => JSON.parse(text('contents'));

/** The GLB. */
export const readScene = () => bytes(text('scene')).buffer;

/** The half floats of a measurement's table. */
export const readMeasurement = () => new Uint16Array(bytes(text('measurement')).buffer);
