#!/usr/bin/env bash
# Runs the Blender tests in every version that setup-blender.sh installed, on what the
# binary bakes and exports. Arguments go to pytest: scripts/test-blender.sh -k gltf
set -euo pipefail
cd "$(dirname "$0")/.."

# As the tests build it, so that nothing is compiled twice.
cargo test --quiet --no-run --test cli
for python in .venv-bpy*/bin/python; do
  echo "-- $("$python" -c 'import bpy; print("Blender", bpy.app.version_string)' 2>/dev/null)"
  "$python" -m pytest --quiet tests/blender "$@"
done
