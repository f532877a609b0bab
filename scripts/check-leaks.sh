#!/usr/bin/env bash
# Shows that memory does not grow: 20 times the whole road in one process, from the phantom to a session in the model.
set -euo pipefail

usage() {
  cat <<'EOF'
Usage: scripts/check-leaks.sh [--tree DIR] [--cycles N] [--quick] [--valgrind] [--heaptrack]
  --tree DIR   build tree with the tests (default: build/paraview)
  --cycles N   cycles in one process, 3 at least (default: 20)
  --quick      measure the model against itself instead of the truth, and without a session of the simulator
  --valgrind   also one cycle, and 3 beats of three filters, under valgrind's memcheck (slow: many minutes)
  --heaptrack  also 2 and 6 cycles under heaptrack: the longer run may leave no byte more than the shorter one
Exit code 1 when memory grows, or valgrind finds memory of ours that is lost.
EOF
}

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
tree="$root/build/paraview"
cycles=20
quick=()
valgrind=no
heaptrack=no
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
    --quick) quick=(--quick) ;;
    --valgrind) valgrind=yes ;;
    --heaptrack) heaptrack=yes ;;
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
filters="$tree/bin/TestMemoryGrowth"
road="$tree/bin/soak-pipeline"
for program in "$filters" "$road"; do
  if [ ! -x "$program" ]; then
    echo "check-leaks: no $program; build the tree first, with -D DYNAMICCORONARY_NIGHTLY_TESTS=ON" >&2
    exit 2
  fi
done

# The allocator's caches of the threads fill by and by, which looks like growth.
echo "== The whole road"
GLIBC_TUNABLES=glibc.malloc.tcache_count=0 "$road" "$cycles" "${quick[@]}"
echo "== Phantom, vesselness and skeleton"
GLIBC_TUNABLES=glibc.malloc.tcache_count=0 DYNAMICCORONARY_CYCLES="$cycles" "$filters"

if [ "$valgrind" = yes ]; then
  memcheck=(valgrind --leak-check=full --show-leak-kinds=definite --errors-for-leak-kinds=definite --error-exitcode=1
    --num-callers=30)
  echo "== The whole road under valgrind"
  "${memcheck[@]}" "$road" 1 --quick
  echo "== Phantom, vesselness and skeleton under valgrind"
  DYNAMICCORONARY_CYCLES=3 "${memcheck[@]}" "$filters"
fi

if [ "$heaptrack" = yes ]; then
  work="$(mktemp -d)"
  trap 'rm -rf "$work"' EXIT
  for count in 2 6; do
    echo "== $count cycles under heaptrack"
    heaptrack -o "$work/$count" "$road" "$count" --quick >"$work/log" 2>&1 || {
      cat "$work/log" >&2
      exit 1
    }
    heaptrack_print -f "$work/$count".* -p 0 -a 0 -T 0 2>"$work/log" | grep "total memory leaked"
  done
  difference="$(heaptrack_print -f "$work"/6.* -d "$work"/2.* -p 0 -a 0 -T 0 2>"$work/log" |
    sed -n 's/^total memory leaked: //p')"
  echo "== The longer run leaves $difference more"
  [ "$difference" = 0B ]
fi
