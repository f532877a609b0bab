#!/usr/bin/env bash
# Runs the programs that measure and validate, and leaves their tables in a folder: what
# docs/validation.md reports.
set -euo pipefail

usage() {
  cat <<'EOF'
Usage: scripts/validate.sh [--build DIR] [--output DIR] [--list] [TABLE ...]
  --build DIR   build tree with the programs (default: build/paraview)
  --output DIR  where the tables go, one Markdown file each (default: validation-output)
  --list        name the tables with their commands, run nothing
Without TABLE all of them, which takes an hour or so. Times are worth something on a quiet machine only.
Table 1 of the paper on ten phantoms: scripts/validate-evaluation.sh.
Exit code 1 when a program fails or a target is missed.
EOF
}

# name: program and its arguments
tables=(
  "vesselness-itk: vesselness-benchmark itk --repeats 3 --strict"
  "vesselness-clinical: vesselness-benchmark clinical --strict"
  "vesselness-methods: vesselness-benchmark methods"
  "vesselness-scales: vesselness-benchmark scales"
  "vesselness-instructions: vesselness-benchmark instructions"
  "vesselness-agreement: vesselness-benchmark agreement"
  "segmentation: validate-segmentation"
  "centerline-speed: centerline-benchmark --strict"
  "centerline: validate-centerline --details --invariance"
  "centerline-coarse: validate-centerline --seeds 205..214 --spacing 0.6"
  "surface: validate-surface"
  "volume: validate-volume"
  "skin-weights: skin-weight-benchmark --sizes 0 1 2 5 3 4"
  "skin-deformation: skin-deformation-benchmark --benchmark_repetitions=5 --benchmark_report_aggregates_only=true"
  "mesh-distance: mesh-distance-benchmark --strict"
  "volume-cgal: validate-volume --backend CGAL --seeds 3 --variants plain"
  "motion: validate-motion --seeds 101..110 --details"
  "motion-ideal: validate-motion --seeds 101..110 --window 0"
  "motion-140ms: validate-motion --seeds 101..110 --window 140"
  "motion-lost: validate-motion --seeds 101..110 --lost"
)

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
build="$root/build/paraview"
output="$root/validation-output"
wanted=()
list=no
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
if [ "$list" = yes ]; then
  printf '%s\n' "${tables[@]}"
  exit 0
fi

chosen=()
if [ ${#wanted[@]} -eq 0 ]; then
  chosen=("${tables[@]}")
fi
for name in ${wanted[@]+"${wanted[@]}"}; do
  found=no
  for table in "${tables[@]}"; do
    if [ "${table%%:*}" = "$name" ]; then
      chosen+=("$table")
      found=yes
    fi
  done
  if [ "$found" = no ]; then
    echo "validate: there is no table '$name'; --list names them" >&2
    exit 2
  fi
done
# Needs Google's benchmark library, which only developers have.
if [ ${#wanted[@]} -eq 0 ] && [ ! -x "$build/bin/skin-deformation-benchmark" ]; then
  echo "validate: without skin-deformation, its program was not built" >&2
  kept=()
  for table in "${chosen[@]}"; do
    [ "${table%%:*}" = skin-deformation ] || kept+=("$table")
  done
  chosen=("${kept[@]}")
fi
# All of them first: nobody wants to hear of it after an hour.
for table in "${chosen[@]}"; do
  read -r program _ <<<"${table#*: }"
  if [ ! -x "$build/bin/$program" ]; then
    echo "validate: no $build/bin/$program: build the tree first (cmake --build --preset paraview)" >&2
    exit 1
  fi
done

exec </dev/null
mkdir -p "$output"
failed=()
for table in "${chosen[@]}"; do
  name="${table%%:*}"
  command="${table#*: }"
  read -ra words <<<"$command"
  echo "== $name: $command"
  # Under another name until it is complete.
  partial="$output/$name.md.partial"
  # shellcheck disable=SC2016 # The backticks are Markdown.
  printf '`%s`\n\n' "$command" >"$partial"
  if ! "$build/bin/${words[0]}" "${words[@]:1}" >>"$partial"; then
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
