#!/usr/bin/env bash
# Draws the catalogue's glTF materials of both editions in three.js, Babylon.js, Filament, the Khronos viewer and Blender,
# and writes docs/engines.md. Needs Node.js, Debian's chromium, Python 3.11 and a release build of these sources.
#
#   scripts/engines.sh                       docs/engines.md
#   scripts/engines.sh --environment         its section under the panorama alone
#   scripts/engines.sh FOLDER LIST.json …    other lists of {"label", "material", "name"}: to standard output
#
# The catalogue's pictures stay in $PICTURES (target/engines), and only materials whose numbers changed are drawn again:
# delete the folder after a change of an engine or of a page.
# FOLDER keeps the pictures of other lists.
# SGDBAKE_BIN names the binary, MEASURED the folder of networks, ENVIRONMENT an .hdr panorama, under which all but
# Filament draw too (none: suns only), ENGINES a choice of the engines. The networks as MERL files, to which
# pictures under the panorama are compared, take 3.6 GB in $PICTURES/measurements.
set -euo pipefail
root="$(cd "$(dirname "$0")/.." && pwd)"
here="$root/tests/engines"
binary="${SGDBAKE_BIN:-$root/target/release/sgdbake}"
measured="${MEASURED:-$root/../shared/measured}"
panorama="${ENVIRONMENT-$root/../shared/models/royal_esplanade_1k.hdr}"
engines="${ENGINES:-three babylon filament khronos blender}"
[ -x "$binary" ] || { echo "engines: $binary is not built (cargo build --release)" >&2; exit 1; }
if [ -n "$panorama" ] && [ ! -f "$panorama" ]; then
  echo "engines: $panorama is absent: suns only" >&2
  panorama=""
fi

[ -d "$here/node_modules" ] || npm --prefix "$here" ci
python="$root/.venv-bpy45/bin/python"
[ -x "$python" ] || "$root/scripts/setup-blender.sh" 45
"$python" -c 'import skimage, OpenEXR' 2>/dev/null ||
  "$python" -m pip install --quiet --disable-pip-version-check scikit-image OpenEXR

# draw ENGINE LIST FOLDER [OPTION …]
draw() {
  case "$1" in
    blender) "$python" "$here/blender.py" "$2" "$3/blender" "${@:4}" | { grep '^Blender [0-9]' || true; } ;;
    *) node "$here/draw.mjs" "$1" "$2" "$3/$1" "${@:4}" ;;
  esac
}

scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT
only=()
if [ "${1-}" = --environment ]; then
  [ -n "$panorama" ] || exit 1
  only=(--only-environment); shift
fi
if [ $# -gt 0 ]; then
  folder="$1"; shift
  lists=("$@")
  keep=() output=()
else
  folder="${PICTURES:-$root/target/engines}"
  lists=("$scratch/published.json" "$scratch/refit.json")
  "$python" "$here/materials.py" --check "$binary" >"${lists[0]}"
  "$python" "$here/materials.py" --check "$binary" --refit >"${lists[1]}"
  if [ -n "$panorama" ] && [ -d "$measured" ] && [ ! -d "$folder/measurements" ]; then
    (cd "$root" && cargo run --release --quiet --example networks_to_measurements -- "$folder/measurements.tmp" >/dev/null)
    mv "$folder/measurements.tmp" "$folder/measurements"
  fi
  keep=(--keep) output=(-o "$root/docs/engines.md")
fi

for engine in $engines; do
  [ ${#only[@]} -gt 0 ] || for list in "${lists[@]}"; do
    draw "$engine" "$list" "$folder/$(basename "$list" .json)" "${keep[@]}"
  done
  samples=()
  [ "$engine" != blender ] || samples=(--samples 512)
  [ "$engine" != filament ] || continue # it reads no .hdr
  [ -z "$panorama" ] || for list in "${lists[@]}"; do
    draw "$engine" "$list" "$folder/$(basename "$list" .json)/environment" --size 72 --suns "" --environment "$panorama" "${keep[@]}" "${samples[@]}"
  done
done
"$python" "$here/report.py" "$binary" "$folder" "${lists[@]}" --measured "$measured" ${panorama:+--environment "$panorama"} "${only[@]}" "${output[@]}"
