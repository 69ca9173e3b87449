#!/usr/bin/env python3
"""Makes a Markdown table of the output of `cargo bench --bench brdf`, with ratios in that run.

    cargo bench --bench brdf | python3 benches/table.py
"""

import re
import sys

PAIRS = 512
NANOSECONDS = {"ns": 1.0, "µs": 1e3, "ms": 1e6, "s": 1e9}
BASE = "f64_fitted"

ROW = re.compile(r"^(?P<tree>[│├╰─ ]*)(?P<name>\S+)\s*(?P<rest>.*)$")
TIME = re.compile(r"([\d.]+) (ns|µs|ms|s)\b")


def rows(lines):
    """(name, fastest ns per pair) of every benchmark; an argument follows its function's name.

    The fastest of a hundred runs: on a shared machine the median measures the neighbours.
    """
    group = ""
    for line in lines:
        match = ROW.match(line.rstrip())
        if not match or "─" not in match["tree"]:
            continue
        nested = match["tree"][0] in "│ "
        times = TIME.findall(match["rest"])
        if len(times) < 4:
            group = match["name"]
            continue
        value, unit = times[0]
        name = f"{group} {match['name']}" if nested else match["name"]
        yield name, float(value) * NANOSECONDS[unit] / PAIRS


table = dict(rows(sys.stdin))
base = table[BASE]
print("| what | ns, fastest of 100 | speed as a multiple of scalar f64, fitted masking |")
print("|---|---:|---:|")
for name, nanoseconds in sorted(table.items(), key=lambda item: -item[1]):
    print(f"| {name} | {nanoseconds:.3g} | {base / nanoseconds:.3g} |")
