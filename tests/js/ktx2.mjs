// ktx-parse over the KTX 2 files named as arguments: one JSON line each, with the header, the data
// format descriptor, the manifest entry among the keys, and every texel.
import {readFile} from 'node:fs/promises';
import {read} from 'ktx-parse';
import {DataUtils} from 'three';

function texels({typeSize, levels: [{levelData}]}) {
  const bytes = levelData.slice().buffer;
  return typeSize === 2
    ? Array.from(new Uint16Array(bytes), DataUtils.fromHalfFloat)
    : Array.from(new Float32Array(bytes));
}

for (const file of process.argv.slice(2)) {
  const image = read(new Uint8Array(await readFile(file)));
  const {vkFormat, typeSize, pixelWidth, pixelHeight, pixelDepth, layerCount, faceCount, levels} = image;
  const [{colorModel, colorPrimaries, transferFunction, bytesPlane, samples}] = image.dataFormatDescriptor;
  console.log(JSON.stringify({
    vkFormat, typeSize, pixelWidth, pixelHeight, pixelDepth, layerCount, faceCount,
    levels: levels.length,
    supercompression: image.supercompressionScheme,
    descriptor: {colorModel, colorPrimaries, transferFunction, texelBytes: bytesPlane[0]},
    samples: samples.map(({bitOffset, bitLength, channelType}) => [bitOffset, bitLength + 1, channelType]),
    writer: image.keyValue.KTXwriter,
    // Text, which ends with NUL; the library decodes the format's own keys alone.
    entry: JSON.parse(new TextDecoder().decode(image.keyValue.sgdbake).replace(/\0$/, '')),
    texels: texels(image),
  }));
}
