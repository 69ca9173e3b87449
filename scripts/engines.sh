#!/usr/bin/env bash
# Draws the catalogue's glTF materials in three.js, Babylon.js, Filament, the Khronos viewer and Blender, and writes
# docs/engines.md. Needs Node.js, Debian's chromium, Python 3.11 and a release build; takes about 10 minutes.
#
#   scripts/engines.sh                       both editions, suns and environment: docs/engines.md
#   scripts/engines.sh FOLDER LIST.json …    other lists of {"label", "material", "name"}: to standard output
#
# FOLDER keeps the pictures. SGDBAKE_BIN names the binary, MEASURED the folder of networks, ENVIRONMENT an .hdr panorama
# (none: suns only), ENGINES a choice of the engines.
set -euo pipefail
root="$(cd "$(dirname "$0")/.." && pwd)"
here="$root/tests/engines"
binary="${SGDBAKE_BIN:-$root/target/release/sgdbake}"
measured="${MEASURED:-$root/../shared/measured}"
[ -x "$binary" ] || { echo "engines: $binary is not built (cargo build --release)" >&2; exit 1; }

[ -d "$here/node_modules" ] || npm --prefix "$here" ci
python="$root/.venv-bpy45/bin/python"
[ -x "$python" ] || "$root/scripts/setup-blender.sh" 45
"$python" -c 'import skimage, OpenEXR' 2>/dev/null ||
  "$python" -m pip install --quiet --disable-pip-version-check scikit-image OpenEXR

if [ $# -gt 0 ]; then
  folder="$1"; shift
  lists=("$@")
  output=()
else
  folder="$(mktemp -d)"
  trap 'rm -rf "$folder"' EXIT
  lists=("$folder/published.json")
  "$python" "$here/materials.py" "$binary" >"${lists[0]}"
  if "$python" "$here/materials.py" "$binary" --refit >"$folder/refit.json" 2>/dev/null; then
    lists+=("$folder/refit.json")
  else
    echo "engines: no refitted edition in this build" >&2
  fi
  output=(-o "$root/docs/engines.md")
fi
environment=()
[ -z "${ENVIRONMENT:-}" ] || environment=(--environment "$ENVIRONMENT")
for list in "${lists[@]}"; do
  pictures="$folder/$(basename "$list" .json)"
  for engine in ${ENGINES:-three babylon filament khronos blender}; do
    case "$engine" in
      blender) "$python" "$here/blender.py" "$list" "$pictures/blender" "${environment[@]}" | grep '^Blender [0-9]' ;;
      filament) node "$here/draw.mjs" filament "$list" "$pictures/filament" ;; # reads no .hdr
      *) node "$here/draw.mjs" "$engine" "$list" "$pictures/$engine" "${environment[@]}" ;;
    esac
  done
done
"$python" "$here/report.py" "$binary" "$folder" "${lists[@]}" --measured "$measured" "${environment[@]}" "${output[@]}"
