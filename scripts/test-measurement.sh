#!/usr/bin/env bash
# Mitsuba 3, from PyPI into .venv-mitsuba, reads the measurement files that `sgdbake tabulate`
# writes, and renders a ball with each. A folder named as argument keeps the pictures.
set -euo pipefail
cd "$(dirname "$0")/.."

# As the tests build it, so that nothing is compiled twice.
cargo test --quiet --no-run --test cli
sgdbake=target/debug/sgdbake

[ -x .venv-mitsuba/bin/python ] || python3 -m venv .venv-mitsuba
.venv-mitsuba/bin/pip install --quiet --disable-pip-version-check 'mitsuba>=3.5,<4' 'numpy<3'
.venv-mitsuba/bin/python tests/readers/measured_mitsuba.py "$sgdbake" "$@"
