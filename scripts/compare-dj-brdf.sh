#!/usr/bin/env bash
# Compares the batch's speed with dj_brdf's SGD, on this machine and beside each other:
#
#     scripts/compare-dj-brdf.sh [DIRECTORY WITH dj_brdf.h]
#
# The header is taken from beside this script unless a folder is given; nothing is fetched. Needs a
# C++ compiler (CXX, or c++). Each program runs three times, in turn, and its fastest run counts.
set -euo pipefail
scripts=$(cd "$(dirname "$0")" && pwd)
folder=$(cd "${1:-$scripts}" && pwd)
if [ ! -f "$folder/dj_brdf.h" ]; then
  echo "no dj_brdf.h in $folder: put it there; it is one file of https://github.com/jdupuy/dj_brdf" >&2
  exit 1
fi
cd "$scripts/.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Its log lines go to standard output; the time is the last.
"${CXX:-c++}" -O3 -march=native -w -I "$folder" benches/dj_brdf.cpp -o "$work/dj_brdf"
cargo bench --quiet --bench brdf --no-run
for run in 1 2 3; do
  "$work/dj_brdf" | tail -n 1 >> "$work/theirs"
  cargo bench --quiet --bench brdf -- 'f64_fitted$|batch_exact$' | python3 benches/table.py > "$work/ours.$run"
done

python3 - "$work" << 'END'
import pathlib, sys
work = pathlib.Path(sys.argv[1])
theirs = min(float(line) for line in (work / "theirs").read_text().split())
ours = {}
for table in work.glob("ours.*"):
    for line in table.read_text().splitlines()[2:]:
        name, nanoseconds = [cell.strip() for cell in line.split("|")[1:3]]
        ours[name] = min(float(nanoseconds), ours.get(name, float("inf")))
print("| what | ns, fastest of three runs | speed as a multiple of dj_brdf |")
print("|---|---:|---:|")
print(f"| dj_brdf | {theirs:.3g} | 1 |")
for name, nanoseconds in sorted(ours.items(), key=lambda item: -item[1]):
    print(f"| {name} | {nanoseconds:.3g} | {theirs / nanoseconds:.3g} |")
END
