#!/usr/bin/env bash
# Writes the pages under docs/ that the program itself prints: cli.md and audit.md, and with
# --speed the measurements of speed-error.md, with --fits the errors of fits.md (which need the
# environment image of ../shared, or one named after it), with --measurements measurements.md,
# editions.svg and networks.md (which need the networks of ../shared). tests/docs.rs fails when cli.md is out of date.
set -euo pipefail
cd "$(dirname "$0")/.."

cargo build --release --quiet
sgdbake=target/release/sgdbake

cli_page() {
    printf '# Command line\n\nWhat `sgdbake --help` and the help of every command print.\n'
    printf '\n```text\n$ sgdbake --help\n%s\n```\n' "$("$sgdbake" --help)"
    "$sgdbake" --help | sed -n '/^Commands:/,/^$/s/^  \([a-z-]*\) .*/\1/p' | grep -v '^help$' |
        while read -r command; do
            printf '\n## %s\n\n```text\n$ sgdbake %s --help\n%s\n```\n' \
                "$command" "$command" "$("$sgdbake" "$command" --help)"
        done
}

cli_page >docs/cli.md
"$sgdbake" audit --all >docs/audit.md
if [[ ${1-} == --speed ]]; then
    materials=(gold-paint chrome alum-bronze blue-acrylic pink-fabric white-paint)
    "$sgdbake" speed-error "${materials[@]/#/--material=}" -o docs
fi
if [[ ${1-} == --fits ]]; then
    environment="${2:-${SGDBAKE_SHARED:-../shared}/models/royal_esplanade_1k.hdr}"
    cargo run --release --quiet --example study_fit_objective -- "$environment" >target/fit-objective.md
    cargo run --release --quiet --example study_fits_page -- target/fit-objective.md
fi
if [[ ${1-} == --measurements ]]; then
    environment="${2:-${SGDBAKE_SHARED:-../shared}/models/royal_esplanade_1k.hdr}"
    cargo run --release --quiet --example measurements_page -- "$environment"
    cargo run --release --quiet --example networks_page >target/networks.md
    mv target/networks.md docs/networks.md
fi
