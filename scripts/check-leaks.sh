#!/usr/bin/env bash
# Shows that memory does not grow: 20 beats of the pipeline in one process, then the same under valgrind.
set -euo pipefail

usage() {
  cat <<'EOF'
Usage: scripts/check-leaks.sh [--tree DIR] [--cycles N] [--valgrind]
  --tree DIR   build tree with the tests (default: build/paraview)
  --cycles N   beats in one process (default: 20)
  --valgrind   also 3 beats under valgrind's memcheck (slow: many minutes)
Exit code 1 when memory grows, or valgrind finds memory of ours that is lost.
EOF
}

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
tree="$root/build/paraview"
cycles=20
valgrind=no
while [ $# -gt 0 ]; do
  case "$1" in
    --tree)
      tree="${2:?--tree takes a folder}"
      shift
      ;;
    --cycles)
      cycles="${2:?--cycles takes a number}"
      shift
      ;;
    --valgrind) valgrind=yes ;;
    -h | --help)
      usage
      exit 0
      ;;
    *)
      echo "check-leaks: unknown option '$1'" >&2
      usage >&2
      exit 2
      ;;
  esac
  shift
done
program="$tree/bin/TestMemoryGrowth"
if [ ! -x "$program" ]; then
  echo "check-leaks: no $program; build the tree first" >&2
  exit 2
fi
DYNAMICCORONARY_CYCLES="$cycles" "$program"
if [ "$valgrind" = yes ]; then
  DYNAMICCORONARY_CYCLES=3 valgrind --leak-check=full --show-leak-kinds=definite \
    --errors-for-leak-kinds=definite --error-exitcode=1 --num-callers=30 "$program"
fi
