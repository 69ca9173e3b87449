// A panorama of the viewer's own, chosen or dropped.

import {element} from './element.js';

/** Returns a function that asks for a file; `take` gets its bytes and name. Files may be dropped, too. */
export function panoramaInput(take) {
  const input = element('input', {type: 'file', accept: '.hdr', hidden: true});
  const read = async file => { if (file) take(await file.arrayBuffer(), file.name); };
  input.addEventListener('change', () => read(input.files[0]));
  document.body.append(input);
  addEventListener('dragover', event => event.preventDefault());
  addEventListener('drop', event => {
    event.preventDefault();
    read(event.dataTransfer.files[0]);
  });
  return () => {
    input.value = '';
    input.click();
  };
}
