#!/usr/bin/env bash
# Renders docs/gallery.png: twelve materials on the ball in the built-in studio, each as
# path-traced lobes beside its glTF fit. Takes some minutes.
#
#   scripts/gallery.sh [SIZE [SAMPLES]]        default: 128 pixels, 64 samples
set -euo pipefail
cd "$(dirname "$0")/.."

cargo build --quiet
target/debug/sgdbake bake --quiet --force -o target/gallery \
  --material alum-bronze --material gold-metallic-paint --material color-changing-paint2 \
  --material blue-metallic-paint --material cherry-235 --material black-phenolic \
  --material nickel --material red-fabric --material pearl-paint \
  --material green-plastic --material yellow-paint --material two-layer-gold
.venv-bpy50/bin/python blender/gallery.py target/gallery/manifest.json -o docs/gallery.png \
  --size "${1:-128}" --samples "${2:-64}"
