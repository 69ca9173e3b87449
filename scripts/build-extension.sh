#!/usr/bin/env bash
# Builds the Blender extension's zip, with the catalogue baked into it, and validates it with
# Blender's own packer:
#
#   scripts/build-extension.sh [FOLDER]        default: target/
#
# Builds sgdbake if SGDBAKE_BIN names no program, and installs Blender if no version is there.
set -euo pipefail
cd "$(dirname "$0")/.."

if [ -z "${SGDBAKE_BIN:-}" ]; then
  cargo build --release --quiet
  export SGDBAKE_BIN=$PWD/target/release/sgdbake
fi
installed() { ls -d .venv-bpy*/bin/python 2>/dev/null | tail -n 1; }
[ -n "$(installed)" ] || scripts/setup-blender.sh 50
python=$(installed)
out=${1:-target}

"$python" blender/package.py --sgdbake "$SGDBAKE_BIN" -o "$out"
packer=$("$python" -c 'import bpy; print(bpy.utils.resource_path("LOCAL"))')/scripts/addons_core/bl_pkg/cli/blender_ext.py
"$python" "$packer" validate "$out"/sgd_materials-*.zip
