#!/usr/bin/env bash
# Installs what is needed, builds both trees, runs the tests, says what was skipped, and ends with CTest's summaries.
set -euo pipefail

usage() {
  cat <<'EOF'
Usage: scripts/test.sh [--tree paraview|vtk] [--nightly] [--sanitizers] [--no-install] [-j N]
  --tree TREE    one tree only (default: ParaView 5.11 and plain VTK 9.1)
  --nightly      also what takes long, measures time or compares with other programs, on a machine with nothing else to do
  --sanitizers   also the asan and tsan trees (plain VTK)
  --no-install   use what is installed
  -j N           parallel jobs (default: all cores)
Build trees are build/paraview, build/vtk, build/asan and build/tsan; logs and JUnit files are in build/logs.
EOF
}

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
# shellcheck source=scripts/build-first.bash
source "$root/scripts/build-first.bash"
trees=(paraview vtk)
sanitizers=no
nightly=OFF
while [ $# -gt 0 ]; do
  taken=1
  case "$1" in
    --tree)
      trees=("${2:-}")
      taken=$(($# > 1 ? 2 : 1))
      ;;
    --tree=*) trees=("${1#*=}") ;;
    --nightly) nightly=ON ;;
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
  wanted=()
  if [ "$needed" != all ]; then
    wanted+=(--tree "$needed")
  fi
  if [ "$nightly" = ON ]; then
    wanted+=(--nightly)
  fi
  scripts/install-dependencies.sh ${wanted[@]+"${wanted[@]}"}
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

# build TREE
build() {
  if [ "$1" != paraview ] && [ -z "${DYNAMICCORONARY_VTK_DIR:-}" ]; then
    DYNAMICCORONARY_VTK_DIR="$(scripts/vtk-prefix.sh)"
    export DYNAMICCORONARY_VTK_DIR
  fi
  cmake --preset "$1" -D "DYNAMICCORONARY_NIGHTLY_TESTS=$nightly" && cmake --build --preset "$1" -j "$jobs"
}

# The process group that builds the next tree with what the tests leave of the cores: some of them want to be alone.
beside=""
trap '[ -z "$beside" ] || kill -- "-$beside" 2>/dev/null || true' EXIT

for index in "${!trees[@]}"; do
  tree="${trees[index]}"
  next="${trees[index + 1]:-}"
  log="$logs/$tree-build.log"
  rm -f "$logs/$tree-tests.log" "$logs/$tree-tests.xml"
  built=yes
  if [ -n "$beside" ]; then
    echo "== $tree: building, begun beside the tests (log: build/logs/$tree-build.log)"
    wait "$beside" || built=no
    beside=""
    tail -n 40 "$log"
  else
    echo "== $tree: building"
    build "$tree" 2>&1 | tee "$log" || built=no
  fi
  if [ "$built" = no ]; then
    failed+=("$tree-build")
    continue
  fi
  if [ -n "$next" ]; then
    set -m
    (renice -n 19 -p "$BASHPID" && build "$next") >"$logs/$next-build.log" 2>&1 &
    beside=$!
    set +m
  fi
  echo "== $tree: testing"
  ctest --preset "$tree" --show-only=json-v1 >"$logs/$tree-tests.json"
  # The sources have been checked.
  if ! ctest --preset "$tree" -j "$jobs" --no-tests=error -E '^CheckSources$' --output-junit "$logs/$tree-tests.xml" \
    --test-output-size-passed 100000 2>&1 | tee "$logs/$tree-tests.log"; then
    failed+=("$tree-tests")
  fi
done

echo
for tree in "${trees[@]}"; do
  if [ -f "$logs/$tree-tests.xml" ]; then
    scripts/test-summary.py "$tree" "$logs/$tree-tests.xml" "$logs/$tree-tests.json" || failed+=("$tree-summary")
  fi
done
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
