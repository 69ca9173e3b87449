#!/usr/bin/env bash
# Runs the Blender tests in every version that setup-blender.sh installed, side by side, on what
# the binary bakes and exports. Arguments go to pytest: scripts/test-blender.sh -k gltf
#
# SGDBAKE_BIN=… names the binary; without it cargo builds one. A version that is not installed is
# named; under CI it is an error.
set -euo pipefail
cd "$(dirname "$0")/.."

# As the tests build it, so that nothing is compiled twice.
[ -n "${SGDBAKE_BIN:-}" ] || cargo test --quiet --no-run --test cli

status=0
for version in 42 45 50 51 52; do
  if [ ! -x ".venv-bpy$version/bin/python" ]; then
    echo "test-blender: NOT TESTED: Blender ${version:0:1}.${version:1} (scripts/setup-blender.sh $version)" >&2
    [ -z "${CI:-}" ] || status=1
  fi
done

logs=$(mktemp -d)
trap 'rm -rf "$logs"' EXIT
declare -A running=()
for python in .venv-bpy*/bin/python; do
  version="$("$python" -c 'import bpy; print(bpy.app.version_string)' 2>/dev/null)"
  "$python" -m pytest --quiet tests/blender "$@" >"$logs/$version" 2>&1 &
  running[$version]=$!
done
for version in "${!running[@]}"; do
  wait "${running[$version]}" || status=1
  printf -- '-- Blender %s\n' "$version"
  cat "$logs/$version"
done
exit "$status"
