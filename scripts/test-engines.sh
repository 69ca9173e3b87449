#!/usr/bin/env bash
# Checks the engines' forms of the glTF material, and pictures of three materials by three.js and the Khronos viewer against
# them. Sets up .venv-engines and tests/engines/node_modules; the pictures need Debian's chromium.
# Arguments go to pytest.
set -euo pipefail
cd "$(dirname "$0")/.."

[ -x .venv-engines/bin/python ] || python3 -m venv .venv-engines
.venv-engines/bin/python -c 'import numpy, skimage, pytest' 2>/dev/null ||
  .venv-engines/bin/python -m pip install --quiet --disable-pip-version-check 'numpy<3' 'scikit-image<1' 'pytest<10'

if [ ! -x "${CHROMIUM:-/usr/bin/chromium}" ] && [ "$(id -u)" = 0 ]; then
  (apt-get update -qq && apt-get install -qq --no-install-recommends chromium >/dev/null) || true
fi
if command -v node >/dev/null && [ -x "${CHROMIUM:-/usr/bin/chromium}" ]; then
  [ -d tests/engines/node_modules ] || npm --prefix tests/engines ci --no-audit --no-fund --loglevel=error
else
  echo "test-engines: NOT TESTED: pictures need Node.js and chromium (Debian: nodejs, chromium; CHROMIUM=… names another)" >&2
  [ -z "${CI:-}" ] || exit 1
fi
.venv-engines/bin/python -m pytest --quiet -rs tests/engines "$@"
