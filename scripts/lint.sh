#!/usr/bin/env bash
# clang-tidy over our own sources, with the compile commands of a configured build tree.
set -euo pipefail

if [ "${1:-}" = -h ] || [ "${1:-}" = --help ]; then
  echo "Usage: scripts/lint.sh [build-folder (build/develop)] [file-regex ...]"
  exit 0
fi
build="${1:-}"
if [ -n "$build" ]; then
  build="$(cd "$build" && pwd)"
  shift
fi
cd "$(dirname "${BASH_SOURCE[0]}")/.."
if [ -z "$build" ]; then
  build="$PWD/build/develop"
  cmake --preset develop >/dev/null
fi

tidy=""
runner=""
for suffix in -14 ""; do
  if command -v "clang-tidy$suffix" >/dev/null && command -v "run-clang-tidy$suffix" >/dev/null; then
    tidy="clang-tidy$suffix"
    runner="run-clang-tidy$suffix"
    break
  fi
done
if [ -z "$tidy" ]; then
  echo "lint: clang-tidy is missing; run scripts/install-dependencies.sh --developer" >&2
  exit 1
fi
if [ ! -f "$build/compile_commands.json" ]; then
  echo "lint: no compile_commands.json in $build; configure it first (cmake --preset develop)" >&2
  exit 1
fi
if grep -q '^CMAKE_UNITY_BUILD:[A-Z]*=ON' "$build/CMakeCache.txt"; then
  echo "lint: $build compiles several sources at once, and its commands name none of them: take build/develop" >&2
  exit 1
fi

if [ $# -gt 0 ]; then
  patterns=("$@")
else
  # Only what we wrote: generated wrapping lives in the build tree.
  patterns=("^$PWD/(Filters|Formats|Readers|Writers|Applications|Simulator)/.*\.cxx$")
fi
"$runner" -quiet -clang-tidy-binary "$tidy" -p "$build" -j "$(nproc)" "${patterns[@]}"
