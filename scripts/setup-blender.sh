#!/usr/bin/env bash
# Installs Blender (the bpy module) and what the Blender tests need into one virtual
# environment per supported version: .venv-bpy42, -bpy45, -bpy50, -bpy51, -bpy52.
#
#   scripts/setup-blender.sh            all versions
#   scripts/setup-blender.sh 50 52      only 5.0 and 5.2
#
# bpy runs in one minor version of Python: 3.11 up to Blender 5.0, 3.13 from 5.1. They are
# looked for on the path and in pyenv; PYTHON311=… and PYTHON313=… name others.
set -euo pipefail
cd "$(dirname "$0")/.."

declare -A release=([42]="4.2.*" [45]="4.5.*" [50]="5.0.*" [51]="5.1.*" [52]="5.2.*")
declare -A needs=([42]=3.11 [45]=3.11 [50]=3.11 [51]=3.13 [52]=3.13)

# The interpreter of a minor version: the first candidate that runs and is that version.
find_python() {
  local minor=$1 named="PYTHON${1/./}" candidate
  for candidate in ${!named:-} "python$minor" "${PYENV_ROOT:-$HOME/.pyenv}/versions/$minor".*/bin/python; do
    if [ "$("$candidate" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null)" = "$minor" ]; then
      printf '%s\n' "$candidate"
      return
    fi
  done
  return 1
}

# Names the shared libraries that bpy needs and the system lacks.
missing_libraries() {
  find "$1"/lib -name '__init__*.so' -path '*bpy*' -exec ldd {} \; | awk '/not found/ {print $1}' | sort -u
}

status=0
for version in ${*:-42 45 50 51 52}; do
  if [ -z "${release[$version]:-}" ]; then
    echo "setup-blender: unknown version $version; known: 42 45 50 51 52" >&2
    exit 2
  fi
  minor=${needs[$version]} venv=".venv-bpy$version"
  if ! python=$(find_python "$minor"); then
    echo "setup-blender: Blender ${release[$version]} needs Python $minor, which was not found;" \
      "install it (pyenv install $minor) or set PYTHON${minor/./}=…" >&2
    status=1
    continue
  fi
  [ -x "$venv/bin/python" ] || "$python" -m venv "$venv"
  if ! "$venv/bin/python" -c 'import bpy, numpy, pytest' 2>/dev/null; then
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check "bpy==${release[$version]}" pytest
  fi
  if ! "$venv/bin/python" -c 'import bpy; print("bpy", bpy.app.version_string)'; then
    missing=$(missing_libraries "$venv")
    echo "setup-blender: Blender ${release[$version]} does not start; missing system libraries:" \
      "${missing:-none that ldd names}. On Debian: apt-get install libx11-6 libxi6 libxxf86vm1" \
      "libxfixes3 libxkbcommon0 libsm6 libice6 libgl1 libegl1" >&2
    status=1
  fi
done
exit "$status"
