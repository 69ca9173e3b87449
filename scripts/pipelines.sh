#!/usr/bin/env bash
# Writes docs/pipelines.md: what the tools that people pass glTF through keep of an exported scene. Needs Node.js and the
# Blenders of scripts/setup-blender.sh 42 52. SGDBAKE names the binary.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/setup-blender.sh 42 52
[ -n "${SGDBAKE:-}" ] || cargo build --release --quiet
npm --prefix tests/pipelines ci --no-audit --no-fund --loglevel=error
node tests/pipelines/page.mjs "${SGDBAKE:-target/release/sgdbake}"
