#!/usr/bin/env bash
# Runs the Blender tests in every version that setup-blender.sh installed, side by side, on what
# the binary bakes and exports. Arguments go to pytest: scripts/test-blender.sh -k gltf
set -euo pipefail
cd "$(dirname "$0")/.."

# As the tests build it, so that nothing is compiled twice.
cargo test --quiet --no-run --test cli

logs=$(mktemp -d)
trap 'rm -rf "$logs"' EXIT
declare -A running=()
for python in .venv-bpy*/bin/python; do
  version="$("$python" -c 'import bpy; print(bpy.app.version_string)' 2>/dev/null)"
  "$python" -m pytest --quiet tests/blender "$@" >"$logs/$version" 2>&1 &
  running[$version]=$!
done
status=0
for version in "${!running[@]}"; do
  wait "${running[$version]}" || status=1
  printf -- '-- Blender %s\n' "$version"
  cat "$logs/$version"
done
exit "$status"
