#!/usr/bin/env bash
# Fits the weights of VeinRejection.cxx, VesselLinking.cxx and VesselTips.cxx to phantoms that nothing else is measured with, and prints them.
set -euo pipefail

usage() {
  cat <<'EOF'
Usage: scripts/fit-odds.sh [--build DIR] [--output DIR] [--wrong]
  --build DIR   build tree with validate-disease (default: build/paraview)
  --output DIR  where the tables of branches, links and tips go (default: odds-output)
  --wrong       also list what is told wrongly
Needs python3-numpy. What was judged depends on the weights that the programs have: fit, build, fit again.
EOF
}

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
build="$root/build/paraview"
output="odds-output"
wrong=()
while (($# > 0)); do
  case "$1" in
    --build) build="${2:?$(usage)}"; shift 2 ;;
    --output) output="${2:?$(usage)}"; shift 2 ;;
    --wrong) wrong=(--wrong); shift ;;
    --help) usage; exit 0 ;;
    *) usage >&2; exit 2 ;;
  esac
done

# Conditions of validate-disease, each with hearts of its own; most where veins and lesions are hard to tell.
hearts=("bright-vein 310..323" "dim-contrast 324..331" "stenoses-70 338..345" "stenoses-90 350..357"
  "left-ramus-60-calcified-20 356..359" "noise-60 362..364" "healthy 368..369" "occlusion 374..379" "calcified-25 382..383"
  "stenoses-70 523..540" "stenoses-90 521..536" "stenoses-70-calcified-25 541..552" "stenoses-70-coarse 553..564"
  "healthy 521..532" "noise-60 521..528")

mkdir -p "$output"
rm -f "$output"/{branches,links,tips}-*.csv
for heart in "${hearts[@]}"; do
  read -r condition seeds <<<"$heart"
  echo "$condition $seeds" >&2
  name="$condition-$seeds"
  # Its limits are another matter; anything but a missed limit is a fault.
  "$build/bin/validate-disease" --no-surface --conditions "$condition" --seeds "$seeds" \
    --branches "$output/branches-$name.csv" --links "$output/links-$name.csv" --tips "$output/tips-$name.csv" >"$output/$name.md" || (($? == 1))
done
for kind in branches links tips; do
  echo "$kind"
  python3 "$root/scripts/fit-odds.py" "$kind" "$output/$kind"-*.csv "${wrong[@]}"
done
