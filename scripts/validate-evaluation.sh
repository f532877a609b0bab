#!/usr/bin/env bash
# The paper's protocol on phantoms: from the images to Table 1, nothing given by hand. Prints Table 1
# and whether the limits are met.
set -euo pipefail

usage() {
  cat <<'EOF'
Usage: scripts/validate-evaluation.sh [--build DIR] [--output DIR] [--seeds LIST] [--lost N] [--keep]
                                      [PHANTOM OPTION ...]
  --build DIR   build tree with coronary-pipeline (default: build/paraview)
  --output DIR  where tables, pictures and the models' surfaces go (default: validation-output/evaluation)
  --seeds LIST  phantoms, "101 102" (default: 101 to 110)
  --lost N      phase that is lost wholly, counted from 1: odd ones are tracked; none (default: 7)
  --keep        keep images and tetrahedra too, 2 GB a phantom
What follows goes to coronary-pipeline phantom; default: --spacing 0.5 --window 66 --noise 25.
A phantom takes about four minutes. Exit code 1 when a limit is missed.
EOF
}

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
build="$root/build/paraview"
output="$root/validation-output/evaluation"
seeds="101 102 103 104 105 106 107 108 109 110"
lost=7
keep=no
phantom=()
while [ $# -gt 0 ]; do
  case "$1" in
    --build | --output | --seeds | --lost)
      if [ $# -lt 2 ] || [ -z "$2" ]; then
        echo "validate-evaluation: $1 takes a value" >&2
        exit 2
      fi
      case "$1" in
        --build) build="$2" ;;
        --output) output="$2" ;;
        --seeds) seeds="$2" ;;
        --lost) lost="$2" ;;
      esac
      shift
      ;;
    --keep) keep=yes ;;
    -h | --help)
      usage
      exit 0
      ;;
    *) phantom+=("$1") ;;
  esac
  shift
done
if [ ${#phantom[@]} -eq 0 ]; then
  phantom=(--spacing 0.5 --window 66 --noise 25)
fi
program="$build/bin/coronary-pipeline"
if [ ! -x "$program" ]; then
  echo "validate-evaluation: no $program: build the tree first (cmake --build --preset paraview)" >&2
  exit 1
fi
if [ "$lost" != none ]; then
  phantom+=(--lost "$lost")
fi

exec </dev/null
mkdir -p "$output"
cases=()
for seed in $seeds; do
  folder="$output/seed-$seed"
  "$program" phantom --seed "$seed" --phases 20 "${phantom[@]}" --quiet --output "$folder/phantom"
  "$program" run "$folder/phantom/series.json" --tracked even --quiet --output "$folder/run"
  if [ "$keep" = no ]; then
    rm -f "$folder"/phantom/phase_*.mha "$folder"/run/*.mha "$folder"/run/*.vtu "$folder"/run/*.dmat \
      "$folder"/run/motion/*.vtu
  fi
  cases+=(--result "$folder/run" --truth "$folder/phantom" --name "seed $seed")
done
"$program" evaluate "${cases[@]}" --output "$output/evaluation"

# Means over the interpolated phases: limits of each case.
awk -F, '
  function unquoted(text) { gsub(/"/, "", text); return text }
  function check(key, low, high, value) {
    value = $column[key]
    if (!(value >= low && value <= high)) {
      printf "missed: %s, %s = %s, wanted %s to %s\n", unquoted($2), key, value, low, high
      missed = 1
    }
  }
  NR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }
  $1 != "B" || $2 == "\"all\"" { next }
  {
    check("found_0.5", 0.98, 1); check("ASSD_mm", 0, 0.35); check("HD95_mm", 0, 1.0); check("HD_mm", 0, 2.5)
    check("BCR", 0.97, 1.03); check("BCS", 0.97, 10)
  }
  END {
    print missed ? "limits missed" : \
      "limits met in every case: found >= 0.98 (radius 0.5 mm), ASSD <= 0.35, HD95 <= 1.0, HD <= 2.5 mm, BCR 0.97 to 1.03, BCS >= 0.97"
    exit missed
  }' "$output/evaluation/table1.csv"
