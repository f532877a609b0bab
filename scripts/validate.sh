#!/usr/bin/env bash
# Runs the programs that measure and validate, and leaves their tables in a folder: what docs/validation.md and
# the pages that it names report.
set -euo pipefail

usage() {
  cat <<'EOF'
Usage: scripts/validate.sh [--build DIR] [--output DIR] [--quick] [--list] [TABLE ...]
  --build DIR   build tree with the programs (default: build/paraview)
  --output DIR  where the tables go, one Markdown file each (default: validation-output)
  --quick       a small form of each table: whether everything runs and agrees. Its numbers
                are not those of the documentation, and its times are worth nothing
  --list        name the tables with their commands, run nothing
Without TABLE all of them, which takes most of a day. `scanned` and `peers` go on where they were stopped.
Times are worth something on a quiet machine only.
Exit code 1 when a program fails or a target is missed.
EOF
}

# name | command | command of the quick form, -: none. What begins with scripts/ is one of ours.
tables=(
  "vesselness-itk | vesselness-benchmark itk --repeats 3 --strict | vesselness-benchmark itk --size 96 --repeats 1"
  "vesselness-clinical | vesselness-benchmark clinical --strict | vesselness-benchmark clinical --clinical-size 128 128 64 --repeats 1"
  "vesselness-methods | vesselness-benchmark methods | vesselness-benchmark methods --size 96 --repeats 1"
  "vesselness-scales | vesselness-benchmark scales | vesselness-benchmark scales --size 96 --repeats 1"
  "vesselness-instructions | vesselness-benchmark instructions | vesselness-benchmark instructions --size 96 --repeats 1"
  "vesselness-agreement | vesselness-benchmark agreement | vesselness-benchmark agreement --agreement-size 64"
  "ostia | validate-ostia | validate-ostia --quick"
  "segmentation | validate-segmentation | validate-segmentation --quick"
  "centerline-speed | centerline-benchmark --strict | centerline-benchmark --size 96 --repeats 1"
  "centerline | validate-centerline --details --invariance | validate-centerline --quick"
  "centerline-coarse | validate-centerline --seeds 205..214 --spacing 0.6 | -"
  "centerline-noisy | validate-centerline --window 140 --noise 40 --spacing 0.5 | -"
  "stenosis | validate-stenosis --details | validate-stenosis --quick"
  "stenosis-axes | validate-stenosis --true-axes --seeds 301..310 | -"
  "disease | validate-disease | validate-disease --quick"
  "surface | validate-surface | validate-surface --quick"
  "surface-unseen | validate-surface --seeds 21..50 --variants varied | -"
  "volume | validate-volume | validate-volume --quick"
  "volume-wall | validate-volume --surface truth --seeds 7..7 --variants plain --phantoms-only | -"
  "volume-cgal | validate-volume --backend CGAL --seeds 3 --variants plain | -"
  "skin-weights | skin-weight-benchmark --sizes 0 1 2 5 6 3 4 | skin-weight-benchmark --sizes 0 --libigl-up-to 0"
  "skin-deformation | skin-deformation-benchmark --benchmark_repetitions=5 --benchmark_report_aggregates_only=true | skin-deformation-benchmark --benchmark_min_time=0.01"
  "mesh-distance | mesh-distance-benchmark --strict | mesh-distance-benchmark --size 10000 --repeats 1"
  "motion | validate-motion --seeds 101..110 --details | validate-motion --quick"
  "motion-ideal | validate-motion --seeds 101..110 --window 0 | -"
  "motion-140ms | validate-motion --seeds 101..110 --window 140 | -"
  "motion-lost | validate-motion --seeds 101..110 --lost | -"
  "motion-filling | validate-filling | validate-filling --quick"
  "motion-measured-heart | validate-real-motion | validate-real-motion --quick"
  "placement | scripts/validate-placement.py --build BUILD --output OUTPUT | -"
  "population | validate-population | validate-population --quick"
  "evaluation | scripts/validate-evaluation.sh --build BUILD --output OUTPUT/evaluation | scripts/validate-evaluation.sh --build BUILD --output OUTPUT/evaluation --seeds 101 --lost none --spacing 0.6"
  "scanned | scripts/validate-scanned.py --build BUILD --output OUTPUT | scripts/validate-scanned.py --quick --build BUILD --output OUTPUT"
  "reconstructor | validate-reconstructor | validate-reconstructor --quick"
  "peers | scripts/validate-peers.py --build BUILD --output OUTPUT | scripts/validate-peers.py --quick --build BUILD --output OUTPUT"
  "wall-speed | vessel-wall-benchmark --strict --benchmark_filter=^Refit --benchmark_repetitions=5 | vessel-wall-benchmark --benchmark_filter=^Refit --benchmark_min_time=0.01"
  "tick-speed | intervention-benchmark --strict --benchmark_filter=^Tick --benchmark_repetitions=3 | intervention-benchmark --benchmark_filter=^RodAlone --benchmark_min_time=0.01"
  "flow | scripts/validate-flow.py --build BUILD --output OUTPUT/flow | -"
  "simulator | scripts/validate-simulator.sh BUILD | scripts/validate-simulator.sh --quick BUILD"
)

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
build="$root/build/paraview"
output="$root/validation-output"
wanted=()
list=no
quick=no
while [ $# -gt 0 ]; do
  case "$1" in
    --build | --output)
      if [ $# -lt 2 ] || [ -z "$2" ]; then
        echo "validate: $1 takes a folder" >&2
        exit 2
      fi
      if [ "$1" = --build ]; then build="$2"; else output="$2"; fi
      shift
      ;;
    --build=?*) build="${1#*=}" ;;
    --output=?*) output="${1#*=}" ;;
    --quick) quick=yes ;;
    --list) list=yes ;;
    -h | --help)
      usage
      exit 0
      ;;
    -*)
      echo "validate: unknown option '$1'" >&2
      usage >&2
      exit 2
      ;;
    *) wanted+=("$1") ;;
  esac
  shift
done

# The line of a table -> its name, its command in the form that is wanted.
name_of() { echo "${1%% | *}"; }
command_of() {
  local rest="${1#* | }"
  local full="${rest%% | *}" small="${rest#* | }"
  if [ "$quick" = yes ]; then echo "$small"; else echo "$full"; fi
}

for name in ${wanted[@]+"${wanted[@]}"}; do
  found=no
  for table in "${tables[@]}"; do
    [ "$(name_of "$table")" != "$name" ] || found=yes
  done
  if [ "$found" = no ]; then
    echo "validate: there is no table '$name'; --list names them" >&2
    exit 2
  fi
done

chosen=()
for table in "${tables[@]}"; do
  name="$(name_of "$table")"
  command="$(command_of "$table")"
  if [ "$command" = - ]; then
    continue
  fi
  if [ ${#wanted[@]} -gt 0 ] && [[ " ${wanted[*]} " != *" $name "* ]]; then
    continue
  fi
  if [ "$list" = yes ]; then
    echo "$name: $command"
    continue
  fi
  program="${command%% *}"
  if [[ "$program" != scripts/* && ! -x "$build/bin/$program" ]]; then
    # Needs Google's benchmark library, which only developers have.
    if [[ "$program" =~ ^(skin-deformation|vessel-wall|intervention)-benchmark$ ]] && [ ${#wanted[@]} -eq 0 ]; then
      echo "validate: without $name, its program was not built" >&2
      continue
    fi
    # All of them are looked for first: nobody wants to hear of it after an hour.
    echo "validate: no $build/bin/$program: build it first (cmake --preset paraview -D DYNAMICCORONARY_NIGHTLY_TESTS=ON, cmake --build --preset paraview)" >&2
    exit 1
  fi
  chosen+=("$table")
done
if [ "$list" = yes ]; then
  exit 0
fi

exec </dev/null
mkdir -p "$output"
failed=()
for table in ${chosen[@]+"${chosen[@]}"}; do
  name="$(name_of "$table")"
  command="$(command_of "$table")"
  read -ra words <<<"$command"
  words=("${words[@]/#BUILD/$build}")
  words=("${words[@]/#OUTPUT/$output}")
  if [[ "${words[0]}" == scripts/* ]]; then words[0]="$root/${words[0]}"; else words[0]="$build/bin/${words[0]}"; fi
  echo "== $name: $command"
  # Under another name until it is complete.
  partial="$output/$name.md.partial"
  # shellcheck disable=SC2016 # The backticks are Markdown.
  printf '`%s`\n\n' "$command" >"$partial"
  if ! "${words[@]}" >>"$partial"; then
    failed+=("$name")
    printf '\n**Failed, or a target is missed.**\n' >>"$partial"
  fi
  mv "$partial" "$output/$name.md"
done
echo "Tables: $output"
if [ ${#failed[@]} -gt 0 ]; then
  echo "FAILED: ${failed[*]}"
  exit 1
fi
