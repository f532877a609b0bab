#!/usr/bin/env bash
# Three pictures beside each other: a coronary tree with its joints at rest, after a first and after a second
# deformation. Needs a display (xvfb-run -a -s "-screen 0 1600x1000x24 -noreset" gives one) and pvpython.
set -euo pipefail

usage() {
  cat <<'EOF'
Usage: scripts/render-posing.sh OUTPUT.png RUN_DIR [MOVE MOVE]
  RUN_DIR  folder of 'coronary-pipeline run --until weights'
  MOVE     JOINT:DX,DY,DZ in mm; default: a joint half way of the longest vessel of each tree, aside
The program is taken from build/paraview/bin, or where POSING says.
EOF
}

if [ $# -ne 2 ] && [ $# -ne 4 ]; then
  usage >&2
  exit 2
fi
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
posing="${POSING:-$root/build/paraview/bin/coronary-posing}"
output="$1"
run="$2"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT

if [ $# -eq 4 ]; then
  moves=("$3" "$4")
else
  mapfile -t moves < <(pvpython "$root/scripts/render-posing.py" moves "$run")
fi
"$posing" "$run" --screenshots "$work" --size 1400x960 \
  --pose-move "${moves[0]}" --pose-move "${moves[1]}" >/dev/null
pvpython "$root/scripts/render-posing.py" join "$output" "$work"/vessels_0[012].png
echo "$output"
