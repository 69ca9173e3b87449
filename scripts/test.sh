#!/usr/bin/env bash
# Runs every test, and sets up what they need inside the checkout: Python packages in .venv*,
# npm packages in tests/js/node_modules. Needs a Rust toolchain, Python 3.11 and Node.js.
set -euo pipefail
cd "$(dirname "$0")/.."

step() { printf '\n== %s\n' "$1"; }

step "format and lints"
cargo fmt --check
cargo clippy --all-targets --quiet -- -D warnings

if [ -f tests/js/package.json ]; then
  step "npm packages: the glTF validator, three.js, ktx-parse"
  (cd tests/js && npm ci --no-audit --no-fund --loglevel=error)
fi

step "Rust: unit tests, laws, reference tables, command line, scenes"
cargo test --quiet --no-fail-fast

step "Textures: independent readers, shaders on a device"
scripts/test-lut.sh

step "Measurement files: Mitsuba reads and renders them"
scripts/test-measurement.sh

step "three.js: the exact material in headless Chromium"
scripts/test-web.sh

if [ -x scripts/setup-blender.sh ]; then
  step "Blender"
  scripts/setup-blender.sh
  scripts/test-blender.sh
fi
