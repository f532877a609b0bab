#!/usr/bin/env bash
# Installs what is needed, builds both trees, runs every test, and ends with CTest's summaries.
set -euo pipefail

usage() {
  cat <<'EOF'
Usage: scripts/test.sh [--tree paraview|vtk] [--sanitizers] [--no-install] [-j N]
  --tree TREE    one tree only (default: ParaView 5.11 and plain VTK 9.1)
  --sanitizers   also the asan and tsan trees (plain VTK)
  --no-install   use what is installed
  -j N           parallel jobs (default: all cores)
Build trees are build/paraview, build/vtk, build/asan and build/tsan.
EOF
}

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
# shellcheck source=scripts/build-first.bash
source "$root/scripts/build-first.bash"
trees=(paraview vtk)
sanitizers=no
while [ $# -gt 0 ]; do
  taken=1
  case "$1" in
    --tree)
      trees=("${2:-}")
      taken=$(($# > 1 ? 2 : 1))
      ;;
    --tree=*) trees=("${1#*=}") ;;
    --sanitizers) sanitizers=yes ;;
    *) build_option "$@" || refuse_option "$1" ;;
  esac
  shift "$taken"
done
for tree in "${trees[@]}"; do
  if [ "$tree" != paraview ] && [ "$tree" != vtk ]; then
    echo "test: --tree takes paraview or vtk, not '$tree'" >&2
    exit 2
  fi
done

exec </dev/null
cd "$root"
needed=all
if [ ${#trees[@]} -eq 1 ] && ! { [ "${trees[0]}" = paraview ] && [ "$sanitizers" = yes ]; }; then
  needed="${trees[0]}"
fi
if [ "$install" = yes ]; then
  if [ "$needed" = all ]; then
    scripts/install-dependencies.sh
  else
    scripts/install-dependencies.sh --tree "$needed"
  fi
fi
if [ "$sanitizers" = yes ]; then
  trees+=(asan tsan)
fi
logs="$root/build/logs"
mkdir -p "$logs"

failed=()
echo "== Sources"
if ! scripts/check-sources.sh; then
  failed+=(sources)
fi

for tree in "${trees[@]}"; do
  rm -f "$logs/$tree-tests.log"
  if [ "$tree" != paraview ] && [ -z "${DYNAMICCORONARY_VTK_DIR:-}" ]; then
    DYNAMICCORONARY_VTK_DIR="$(scripts/vtk-prefix.sh)"
    export DYNAMICCORONARY_VTK_DIR
  fi
  echo "== $tree: configuring (log: build/logs/$tree-configure.log)"
  if ! cmake --preset "$tree" >"$logs/$tree-configure.log" 2>&1; then
    tail -n 40 "$logs/$tree-configure.log"
    failed+=("$tree-configure")
    continue
  fi
  echo "== $tree: building"
  if ! cmake --build --preset "$tree" -j "$jobs"; then
    failed+=("$tree-build")
    continue
  fi
  echo "== $tree: testing"
  if ! ctest --preset "$tree" -j "$jobs" --no-tests=error 2>&1 | tee "$logs/$tree-tests.log"; then
    failed+=("$tree-tests")
  fi
done

echo
for tree in "${trees[@]}"; do
  echo "== $tree"
  if [ -f "$logs/$tree-tests.log" ]; then
    sed -n '/^[0-9]*% tests passed/,$p' "$logs/$tree-tests.log"
  else
    echo "no tests ran: see above"
  fi
done
if [ ${#failed[@]} -gt 0 ]; then
  echo "FAILED: ${failed[*]}"
  exit 1
fi
