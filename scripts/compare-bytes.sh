#!/usr/bin/env bash
# Runs a fixed set of commands with a binary and keeps every byte that they print and write; then
# compares two such folders.
#
#   scripts/compare-bytes.sh run SGDBAKE FOLDER      fills FOLDER, a minute or less
#   scripts/compare-bytes.sh diff BEFORE AFTER       lists what differs; exit 1 if anything does
#
# Times are no part of it: fields that hold a measured time are blanked out.
set -euo pipefail

run() {
    local sgdbake folder
    sgdbake=$(realpath "$1")
    mkdir -p "$2"
    folder=$(realpath "$2")
    [ -z "$(ls -A "$folder")" ] || { echo "compare-bytes: $2 is not empty" >&2; exit 1; }
    cd "$folder"
    mkdir -p print scenes

    # `keep NAME COMMAND…` keeps what a command prints and how it ends.
    keep() {
        local name=$1 code=0
        shift
        "$sgdbake" "$@" >"print/$name.out" 2>"print/$name.err" || code=$?
        echo "$code" >"print/$name.code"
        sed -i -E 's/"evaluation_ns":[0-9.e+-]+/"evaluation_ns":0/g' "print/$name.out"
    }

    cat >my-paint.toml <<'TOML'
name = "my-paint"
[r]
rho_d = 0.14
rho_s = 0.16
alpha = 0.12
p = 0.79
f0 = 0.05
f1 = -0.6
[g]
rho_d = 0.10
rho_s = 0.16
alpha = 0.12
p = 0.79
f0 = 0.05
f1 = -0.6
[b]
rho_d = 0.02
rho_s = 0
alpha = 0.2
p = 0.5
f0 = 0.04
f1 = 0
TOML
    printf 'wi_x,wi_y,wi_z,wo_x,wo_y,wo_z\n0.3,0,1,-0.3,0,1\n1,0.2,0.01,-1,0,0.02\n0,0,1,0,0,1\n0,1,-1,0,0,1\n' >pairs.csv
    local materials=(gold-paint chrome black-fabric my-paint.toml) material name
    local some=(--material gold-paint --material black-fabric --material my-paint.toml)

    keep materials materials
    keep materials-json materials --json
    for material in "${materials[@]}"; do
        name=${material%.toml}
        keep "material-$name" materials "$material"
        keep "material-$name-json" materials "$material" --json
        for masking in exact fitted; do
            for precision in f64 f32; do
                keep "eval-$name-$masking-$precision" eval --material "$material" --pairs pairs.csv \
                    --masking "$masking" --precision "$precision" --json
                keep "slice-$name-$masking-$precision" slice --material "$material" \
                    --theta-deg 0,1,30,80,89.99,90 --masking "$masking" --precision "$precision" --json
            done
        done
    done
    keep eval-text eval --material chrome --wi 0.3,0,1 --wo=-0.3,0,1
    keep slice-text slice --material chrome --theta-deg 0,45
    for strategy in vndf ggx published; do
        keep "sample-$strategy" sample --material gold-paint --wo 1,0,0.2 -n 20000 --seed 7 \
            --strategy "$strategy" --json
    done

    keep bake-exr bake "${some[@]}" --tolerance 1e-2 --quantity ndf,masking,fresnel,albedo -o bake-exr --json
    keep bake-ktx2 bake "${some[@]}" --size 24 --quantity ndf,masking,fresnel,albedo,brdf3d \
        --format ktx2 --depth float --masking fitted -o bake-ktx2 --json
    keep bake-png bake "${some[@]}" --tolerance 1e-2 --quantity masking,fresnel,albedo --format png -o bake-png
    keep bake-3d bake --material gold-paint --quantity brdf3d --tolerance 5e-2 -o bake-3d --json
    keep bake-dry bake --material chrome --size 16 -o bake-dry --dry-run
    keep bake-refused bake --material chrome --tolerance 1e-6 --depth half -o bake-refused

    keep fit fit "${some[@]}" --json
    keep export-glb export --shape ball --assign '*=gold-paint' --tolerance 1e-2 -o scenes/ball.glb --json
    keep export-gltf export scenes/ball.glb --assign 'ball=my-paint.toml' --tolerance 1e-2 -o scenes/ball.gltf
    keep export-prune export scenes/ball.glb --prune --assign '#0=black-fabric' --tolerance 1e-2 -o scenes/pruned.glb
    printf 'o quad\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl a\nf 1 2 3 4\n' >quad.obj
    keep export-obj export quad.obj --assign '*=chrome' --tolerance 1e-2 -o scenes/quad.glb
    keep bake-scene bake quad.obj --assign 'a=chrome' --size 16 -o bake-scene

    keep audit audit "${some[@]}" --json
    keep audit-text audit --material chrome
    keep sheet sheet --material gold-paint -o sheets
    for model in sgd ggx lut; do
        keep "preview-$model" preview --material gold-paint --material my-paint.toml --size 16 \
            --samples 16 --model "$model" -o "preview-$model.png"
    done
    keep preview-exr preview --material chrome --size 16 --samples 16 -o preview.exr
    for file in scenes/ball.glb scenes/ball.gltf bake-exr/manifest.json bake-exr/ndf.exr \
        bake-ktx2/brdf3d-0.ktx2 bake-png/fresnel.png; do
        name=${file//\//-}
        keep "inspect-$name" inspect "$file"
        keep "inspect-$name-json" inspect "$file" --json
    done
}

# Lists what is only in one folder, and what differs.
compare() {
    diff --brief --recursive "$1" "$2" && echo "no byte differs in $(find "$1" -type f | wc -l) files"
}

case ${1-} in
run) run "$2" "$3" ;;
diff) compare "$2" "$3" ;;
*) sed -n '2,8s/^# \?//p' "$0" >&2; exit 2 ;;
esac
