#!/usr/bin/env bash
# Runs every test, and sets up what they need inside the checkout: Python packages in .venv*, npm
# packages in node_modules under web and tests. Needs a Rust toolchain, Python 3.11, Python 3.13
# for Blender 5.2, and Node.js.
set -euo pipefail
cd "$(dirname "$0")/.."

step() { printf '\n== %s\n' "$1"; }

step "format and lints"
cargo fmt --check
cargo clippy --all-targets --quiet -- -D warnings

step "feature levels: none, full"
cargo check --quiet --no-default-features
cargo check --quiet --no-default-features --features full

if rustup target add aarch64-unknown-linux-gnu > /dev/null 2>&1; then
  step "64-bit Arm: the loops for NEON"
  RUSTFLAGS='-D warnings' cargo check --quiet --lib --no-default-features \
    --target aarch64-unknown-linux-gnu
else
  echo "skipped: the target aarch64-unknown-linux-gnu cannot be installed" >&2
fi

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

step "Engines: their forms, three materials' pictures"
scripts/test-engines.sh

step "three.js: the exact material in headless Chromium"
scripts/test-web.sh

step "Blender: the oldest and the newest version; scripts/test-blender.sh alone takes all five"
scripts/setup-blender.sh 42 52
scripts/test-blender.sh 42 52

step "Tools that people pass glTF through: what they keep, and what restore brings back"
scripts/test-pipelines.sh
