#!/usr/bin/env bash
# Bakes, then reads the textures with programs that know only docs/lut-format.md: OpenEXR, OpenCV
# and numpy in .venv; the shaders on a Vulkan and an OpenGL device, Mesa's software ones if need be.
set -euo pipefail
cd "$(dirname "$0")/.."

# As the tests build it, so that nothing is compiled twice.
cargo test --quiet --no-run --test cli
sgdbake=target/debug/sgdbake
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT

[ -x .venv/bin/python ] || python3 -m venv .venv
.venv/bin/pip install --quiet --disable-pip-version-check \
  'numpy<3' 'OpenEXR>=3.3,<4' 'opencv-python-headless<6' 'wgpu<1' 'moderngl<6'

.venv/bin/python tests/readers/formats.py "$sgdbake"

sharp_and_rough=(--material chrome-steel --material specular-orange-phenolic
  --material pink-fabric --material beige-fabric --material black-fabric)
for tolerance in 1e-2 1e-3 1e-4; do
  "$sgdbake" bake "${sharp_and_rough[@]}" --tolerance "$tolerance" -o "$out/$tolerance" --quiet > /dev/null
  .venv/bin/python tests/readers/lut_reader.py "$sgdbake" "$out/$tolerance"
done
"$sgdbake" bake --material chrome --material teflon --quantity brdf3d --tolerance 1e-2 \
  --format ktx2 -o "$out/3d" --quiet > /dev/null
.venv/bin/python tests/readers/lut_reader.py "$sgdbake" "$out/3d"

if ! ls /usr/share/vulkan/icd.d/*.json > /dev/null 2>&1 && [ "$(id -u)" = 0 ]; then
  apt-get update -qq && apt-get install -qq --no-install-recommends \
    mesa-vulkan-drivers libegl1 libgl1-mesa-dri > /dev/null || true
fi
if ls /usr/share/vulkan/icd.d/*.json > /dev/null 2>&1; then
  export XDG_RUNTIME_DIR=${XDG_RUNTIME_DIR:-$out}
  for bake in 1e-3 3d; do
    .venv/bin/python tests/readers/run_shaders.py "$sgdbake" "$out/$bake"
  done
else
  echo "skipped: the shaders need a Vulkan device (Debian: mesa-vulkan-drivers, libegl1, libgl1-mesa-dri)"
fi
