#!/usr/bin/env bash
# The npm package in web/: types, then its pictures and the page of `sgdbake view` in headless
# Chromium, against this sgdbake.
# SGD_WEB_ALL=1 draws all materials, SGD_WEB_HDR=FILE.hdr compares under that panorama too,
# SGD_WEB_COST=1 measures frames. Needs Node.js; Chromium is installed where apt-get can.
set -euo pipefail
cd "$(dirname "$0")/.."

export CHROMIUM=${CHROMIUM:-/usr/bin/chromium}
if [ ! -x "$CHROMIUM" ] && [ "$(id -u)" = 0 ]; then
  (apt-get update -qq && apt-get install -qq --no-install-recommends chromium > /dev/null) || true
fi
if [ ! -x "$CHROMIUM" ]; then
  echo "test-web: NOT TESTED: needs Chromium (Debian: chromium), or CHROMIUM=PATH"
  [ -z "${CI:-}" ] || exit 1
  exit 0
fi

if [ -z "${SGDBAKE:-}" ]; then
  # As the tests build it, so that nothing is compiled twice.
  cargo test --quiet --no-run --test cli
  export SGDBAKE=$PWD/target/debug/sgdbake
fi

cd web
npm ci --no-audit --no-fund --loglevel=error
npm run --silent types
node --test --test-concurrency=1 test/*.test.mjs
