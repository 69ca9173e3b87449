// The official glTF validator over the files named as arguments: one JSON line each, with every
// message of severity error, and the counts of errors and warnings.
import {readFile} from 'node:fs/promises';
import {dirname, join} from 'node:path';
import {validateBytes} from 'gltf-validator';

for (const file of process.argv.slice(2)) {
  const report = await validateBytes(new Uint8Array(await readFile(file)), {
    uri: file,
    maxIssues: 0,
    externalResourceFunction: async uri =>
      new Uint8Array(await readFile(join(dirname(file), decodeURIComponent(uri)))),
  });
  const errors = report.issues.messages.filter(message => message.severity === 0);
  console.log(JSON.stringify({
    file,
    errors: errors.map(({code, message, pointer}) => ({code, message, pointer})),
    warnings: report.issues.numWarnings,
  }));
}
