// The tools that an exported scene is passed through. Each has a name, the version that runs here, how it is run, as the
// page says it, and `run(input, output)`.
import { execFileSync } from "node:child_process";
import { existsSync, readFileSync } from "node:fs";
import { join } from "node:path";

const HERE = import.meta.dirname;
const ROOT = join(HERE, "../..");
const PACKAGES = join(HERE, "node_modules");

const run = (program, arguments_) => execFileSync(program, arguments_, { stdio: ["ignore", "pipe", "pipe"], encoding: "utf8" });
const version = (name) => JSON.parse(readFileSync(join(PACKAGES, name, "package.json"), "utf8")).version;

function command(tool, name, line) {
  const [program, ...options] = line.split(" ");
  const fill = (input, output) => options.map((option) => ({ IN: input, OUT: output })[option] ?? option);
  return { tool: `${tool} ${version(name)}`, how: `\`${line}\``, run: (input, output) => run(join(PACKAGES, ".bin", program), fill(input, output)) };
}

const gltfTransform = (line) => command("glTF-Transform", "@gltf-transform/cli", `gltf-transform ${line}`);
const gltfpack = (line) => command("gltfpack", "gltfpack", `gltfpack -i IN -o OUT${line}`);

/** A script of one of these libraries: it prints nothing and writes OUT. */
const script = (tool, name, how, mode) => ({ tool: `${tool} ${version(name)}`, how, run: (input, output) => run("node", [join(HERE, mode[0]), input, output, ...mode.slice(1)]) });

/** Blender without our add-on, where its virtual environment exists. */
function blender(number, how, ...mode) {
  const python = join(ROOT, `.venv-bpy${number}/bin/python`);
  const tool = `Blender ${number[0]}.${number[1]}`;
  return { tool, how, absent: !existsSync(python), run: (input, output) => run(python, [join(HERE, "blender.py"), input, output, ...mode]) };
}

export const PIPELINES = [
  gltfTransform("copy IN OUT"),
  gltfTransform("optimize IN OUT"),
  gltfTransform("optimize IN OUT --palette false"),
  gltfpack(""),
  gltfpack(" -ke"),
  gltfpack(" -ke -km -c"),
  script("three.js", "three", "`GLTFLoader`, `GLTFExporter`", ["three.mjs"]),
  script("three.js", "three", "the same, `includeCustomExtensions: true`", ["three.mjs", "custom"]),
  script("Babylon.js", "@babylonjs/serializers", "`LoadSceneAsync`, `GLTF2Export`", ["babylon.mjs"]),
  ...["42", "52"].flatMap((number) => [
    blender(number, "import, export"),
    blender(number, "the same, *Custom Properties* on (`export_extras=True`)", "extras"),
  ]),
];

