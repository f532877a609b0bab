#!/usr/bin/env bash
# Blood flow in the beating left coronary artery of the demo, by OpenFOAM, with walls that move and with walls at rest: from
# the run of scripts/demo.sh (which is made when it is not there) to curves, pictures and a table of what the motion changes.
# Run again, it goes on from where it was stopped. Everything lands in demo-output/flow (--short: flow-short).
set -euo pipefail

usage() {
  cat <<'USAGE'
Usage: scripts/demo-flow.sh [--no-install] [--short] [--tree N] [-j N]
  --no-install  use what is installed
  --short       a few time steps only: that all parts work, not a result
  --tree N      0 left (default), 1 right
  -j N          parallel jobs of the build (default: all cores)
USAGE
}

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
# shellcheck source=scripts/build-first.bash
source "$root/scripts/build-first.bash"
short=no
tree=0
while [ $# -gt 0 ]; do
  taken=1
  case "$1" in
    --short) short=yes ;;
    --tree)
      tree="${2:-}"
      taken=2
      ;;
    *) build_option "$@" || refuse_option "$1" ;;
  esac
  shift "$taken"
done
case "$tree" in
  0 | 1) ;;
  *)
    echo "demo-flow: --tree takes 0 or 1, not '$tree'" >&2
    exit 2
    ;;
esac

exec </dev/null
cd "$root"
output=demo-output
mkdir -p "$output"
install_and_build build/logs/demo-build.log
if ! command -v pimpleFoam >/dev/null; then
  scripts/install-dependencies.sh --flow
fi
pipeline="$root/build/paraview/bin/coronary-pipeline"

if [ ! -e "$output/run/motion/skeleton.vtp.series" ]; then
  echo "== The run of scripts/demo.sh"
  scripts/demo.sh --no-install --no-pictures -j "$jobs"
fi

steps=500
# Three tenths of a cycle are start-up.
cycles=1.3
if [ "$short" = yes ]; then
  cycles=1
fi
results="$output/flow"
if [ "$short" = yes ]; then
  results="$output/flow-short"
fi
cases=()
for walls in moving rest; do
  folder="$results/$walls"
  still=()
  if [ "$walls" = rest ]; then
    still=(--flow-rest)
  fi
  if [ ! -e "$folder/mesh_openfoam.json" ]; then
    echo "== A coarse mesh for flow, walls: $walls"
    "$pipeline" sequence "$output/run" --formats openfoam --flow-tree "$tree" --flow-edge 0.65 --flow-layers 3 --flow-extension 0.5 \
      --flow-cycles "$cycles" --flow-steps "$steps" --flow-frames "$steps" "${still[@]}" --output "$folder"
  fi
  found=("$folder"/mesh_openfoam_*/)
  cases+=("${found[0]%/}")
done

for case in "${cases[@]}"; do
  if [ "$(tail -n 2 "$case/log.solver" 2>/dev/null | head -n 1)" = End ]; then
    continue
  fi
  if [ "$short" = yes ]; then
    # Ten steps, written at the fifth and the tenth.
    step="$(sed -n 's/^deltaT \(.*\);/\1/p' "$case/system/controlDict")"
    times() { awk -v step="$step" -v n="$1" 'BEGIN { printf "%.10g", n * step }'; }
    sed -i -e "s/^endTime .*/endTime $(times 10);/" -e "s/^writeInterval .*/writeInterval $(times 5);/" "$case/system/controlDict"
  fi
  echo "== Flow in $case"
  sh "$case/Allrun" &
done
# Two cores, two cases.
failed=no
for job in $(jobs -p); do
  wait "$job" || failed=yes
done
if [ "$failed" = yes ]; then
  echo "demo-flow: the solver stopped; see log.solver in ${cases[*]}" >&2
  exit 1
fi

echo "== Curves, pictures and numbers"
/usr/bin/python3 scripts/flow-results.py "${cases[0]}" "${cases[1]}" --output "$results"
xvfb-run -a -s "-screen 0 1600x1000x24 -noreset" pvpython scripts/render-flow.py "${cases[0]}" --output "$results"
cat "$results/motion.txt"
