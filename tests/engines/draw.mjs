// Draws glTF materials in an engine, in headless Chromium.
//
//   node draw.mjs ENGINE MATERIALS.json OUT [--size 48] [--suns 15,40,70,110,140] [--environment FILE.hdr] [--turn DEGREES] [--keep]
//
// ENGINE is three, babylon, khronos or filament. MATERIALS.json is a list of {"label", "material"}, the material as in
// a glTF file's `materials`. Writes OUT/LABEL.f32: for each sun, then for the environment, size · size · 3 floats
// (little-endian; rows upwards; linear radiance under a sun of irradiance pi, so that white facing it is 1).
// --keep draws only what OUT does not hold yet.
import { createServer } from "node:http";
import { existsSync, mkdirSync, readFileSync, renameSync, writeFileSync } from "node:fs";
import { dirname, extname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { parseArgs } from "node:util";
import { build } from "esbuild";
import { chromium } from "playwright-core";

const HERE = dirname(fileURLToPath(import.meta.url));
const TYPES = { ".html": "text/html", ".js": "text/javascript", ".wasm": "application/wasm" };

// What a page expects as globals.
const SCRIPTS = { filament: ["/filament.js"], khronos: ["/khronos-libs/libktx.js"] };
const script = (path) => `<script src="${path}"></script>`;

// Degrees about y that bring the panorama's centre behind the ball, as `sgdbake preview` has it.
const TURNS = { three: 90, babylon: 0, khronos: 270, filament: 0 };

// The Khronos package leaves this table out, and its viewer never uploads it.
const EMPTY_PNG = Buffer.from("iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGNgAAAAAgABc3UBGAAAAABJRU5ErkJggg==", "base64");

const { values: options, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    size: { type: "string", default: "48" },
    suns: { type: "string", default: "15,40,70,110,140" },
    environment: { type: "string" },
    turn: { type: "string" },
    keep: { type: "boolean", default: false },
  },
});
const [engine, list, out] = positionals;
if (!out || !["three", "babylon", "khronos", "filament"].includes(engine)) {
  console.error("usage: node draw.mjs three|babylon|khronos|filament MATERIALS.json OUT [--size N] [--suns A,B,…] [--environment FILE.hdr]");
  process.exit(2);
}

const picture = (label) => join(out, `${label}.f32`);
const entries = JSON.parse(readFileSync(list, "utf8")).filter(({ label }) => !(options.keep && existsSync(picture(label))));
if (entries.length === 0) process.exit(0);

// The Khronos viewer filters its environment when it starts: a minute in software. Under suns, where the
// environment is black, the smallest maps do; under an environment, only its lookup table is made smaller (1024 wide).
function setup(bundler) {
  bundler.onLoad({ filter: /gltf-viewer\.module\.js$/ }, ({ path }) => {
    const source = readFileSync(path, "utf8").replace("this.lutResolution = 1024", "this.lutResolution = 128");
    const small = { textureSize: 32, ggxSampleCount: 4, lambertianSampleCount: 4, sheenSamplCount: 4 };
    const contents = options.environment ? source
      : Object.entries(small).reduce((text, [name, value]) => text.replace(new RegExp(`this\\.${name} = \\d+`), `this.${name} = ${value}`), source);
    return { contents, loader: "js" };
  });
}

const bundle = await build({
  stdin: { contents: `export * from "./pages/${engine}.js"`, resolveDir: HERE },
  plugins: [{ name: "cheap-filter", setup }], bundle: true, format: "iife", globalName: "page", write: false, logLevel: "error", external: ["fs", "path"],
});
const modules = join(HERE, "node_modules");
const files = new Map([
  ["/", `<!doctype html><link rel="icon" href="data:,"><body>${(SCRIPTS[engine] ?? []).map(script).join("")}${script("/page.js")}`],
  ["/page.js", bundle.outputFiles[0].contents],
  ["/filament.js", () => readFileSync(join(modules, "filament/filament.js"))],
  ["/filament.wasm", () => readFileSync(join(modules, "filament/filament.wasm"))],
  ["/lut_sheen_E.png", EMPTY_PNG],
  ["/environment.hdr", () => readFileSync(options.environment)],
]);
const server = createServer((request, response) => {
  const name = request.url.split("?")[0], file = files.get(name);
  const found = file ?? (name.startsWith("/khronos-libs/") && (() => readFileSync(join(modules, "@khronosgroup/gltf-viewer/dist/libs", name.slice(14)))));
  try {
    const body = typeof found === "function" ? found() : found;
    if (!body) throw new Error("not found");
    response.writeHead(200, { "content-type": TYPES[extname(name) || ".html"] ?? "application/octet-stream" }).end(body);
  } catch {
    response.writeHead(404).end();
  }
}).listen(0, "127.0.0.1");
await new Promise((done) => server.once("listening", done));

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--disable-quic",
    "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync"],
});
try {
  const page = await browser.newPage();
  page.on("console", (message) => ["error", "warning"].includes(message.type()) && process.env.VERBOSE && console.error(`${engine}: ${message.text()}`));
  page.on("pageerror", (error) => console.error(`${engine}: ${error.message}`));
  await page.goto(`http://127.0.0.1:${server.address().port}/`);
  const size = Number(options.size), suns = options.suns.split(",").filter(Boolean).map((degrees) => (Number(degrees) * Math.PI) / 180);
  const name = await page.evaluate((o) => window.page.init(o), { size, environment: options.environment && "/environment.hdr", turn: (Number(options.turn ?? TURNS[engine]) * Math.PI) / 180 });
  mkdirSync(out, { recursive: true });
  for (const { label, material } of entries) {
    const encoded = await page.evaluate(async ([m, s]) => {
      const bytes = (await window.page.draw(m, s)).map((p) => new Uint8Array(p.buffer, p.byteOffset, p.byteLength));
      let text = "";
      for (const b of bytes) for (let k = 0; k < b.length; k += 8192) text += String.fromCharCode(...b.subarray(k, k + 8192));
      return btoa(text);
    }, [material, suns]);
    writeFileSync(`${picture(label)}.tmp`, Buffer.from(encoded, "base64"));
    renameSync(`${picture(label)}.tmp`, picture(label));
  }
  console.log(name);
} finally {
  await browser.close();
  server.close();
}
