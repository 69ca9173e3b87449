#!/usr/bin/env bash
# Validates the Blender extension and builds its zip with Blender's own packer:
#
#   scripts/build-extension.sh [FOLDER]        default: target/
set -euo pipefail
cd "$(dirname "$0")/.."

for packer in .venv-bpy50/lib/python3.11/site-packages/bpy/*/scripts/addons_core/bl_pkg/cli/blender_ext.py; do
  .venv-bpy50/bin/python "$packer" validate blender/sgd_materials
  mkdir -p "${1:-target}"
  .venv-bpy50/bin/python "$packer" build --source-dir blender/sgd_materials --output-dir "${1:-target}"
done
