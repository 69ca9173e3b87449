#!/usr/bin/env bash
# Installs real Blender (the bpy module) with what the Blender tests need into
# local virtual environments, one per supported version: .venv-bpy42, -bpy45, -bpy50.
#
#   scripts/setup-blender.sh            all three versions
#   scripts/setup-blender.sh 50         only 5.0
set -euo pipefail
cd "$(dirname "$0")/.."

# bpy is built for this Python alone.
python="${PYTHON311:-python3.11}"
command -v "$python" >/dev/null || {
  echo "setup-blender: $python not found; bpy needs Python 3.11 (set PYTHON311=…)" >&2
  exit 1
}

declare -A release=([42]="4.2.*" [45]="4.5.*" [50]="5.0.*")
for version in "${@:-42 45 50}"; do
  for v in $version; do
    venv=".venv-bpy$v"
    [ -x "$venv/bin/python" ] || "$python" -m venv "$venv"
    "$venv/bin/python" -c 'import bpy, numpy, pytest' 2>/dev/null ||
      "$venv/bin/python" -m pip install --quiet --disable-pip-version-check \
        "bpy==${release[$v]}" pytest
    "$venv/bin/python" -c 'import bpy; print("bpy", bpy.app.version_string)'
  done
done
