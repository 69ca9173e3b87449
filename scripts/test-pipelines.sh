#!/usr/bin/env bash
# Passes an exported scene through glTF-Transform, gltfpack, three.js, Babylon.js and, where scripts/setup-blender.sh
# installed it, Blender, and compares what each kept with docs/pipelines.md. Needs Node.js. SGDBAKE names the binary.
set -euo pipefail
cd "$(dirname "$0")/.."

if ! command -v node >/dev/null; then
  echo "test-pipelines: NOT TESTED: needs Node.js" >&2
  [ -z "${CI:-}" ] || exit 1
  exit 0
fi
if [ -z "${SGDBAKE:-}" ]; then
  # As the tests build it, so that nothing is compiled twice.
  cargo test --quiet --no-run --test cli
  SGDBAKE=$PWD/target/debug/sgdbake
fi
[ -d tests/pipelines/node_modules ] || npm --prefix tests/pipelines ci --no-audit --no-fund --loglevel=error
node tests/pipelines/page.mjs "$SGDBAKE" --check
