#!/usr/bin/env bash
# Runs the Blender tests in the versions that setup-blender.sh installed, side by side, on what
# the binary bakes and exports.
#
#   scripts/test-blender.sh                 all five versions
#   scripts/test-blender.sh 42 52 -k gltf   these versions; the other arguments go to pytest
#
# SGDBAKE_BIN=… names the binary; without it cargo builds one. A version that is not installed is
# named; under CI it is an error.
set -euo pipefail
cd "$(dirname "$0")/.."

# As the tests build it, so that nothing is compiled twice.
[ -n "${SGDBAKE_BIN:-}" ] || cargo test --quiet --no-run --test cli

versions=()
while [[ ${1:-} =~ ^[0-9]{2}$ ]]; do versions+=("$1") && shift; done
[ ${#versions[@]} -gt 0 ] || versions=(42 45 50 51 52)

status=0
installed=()
for version in "${versions[@]}"; do
  if [ ! -x ".venv-bpy$version/bin/python" ]; then
    echo "test-blender: NOT TESTED: Blender ${version:0:1}.${version:1} (scripts/setup-blender.sh $version)" >&2
    [ -z "${CI:-}" ] || status=1
  else
    installed+=(".venv-bpy$version/bin/python")
  fi
done

logs=$(mktemp -d)
trap 'rm -rf "$logs"' EXIT
declare -A running=()
for python in "${installed[@]}"; do
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
