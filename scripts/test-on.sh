#!/usr/bin/env bash
# README's two commands on a pristine system of a suite: HEAD is cloned into a root of its own, and scripts/demo.sh and
# scripts/test.sh run there as on a new machine. The system's base is made once and kept in the user's cache; what a run
# has put on top of it is thrown away.
set -euo pipefail

usage() {
  cat <<'EOF'
Usage: scripts/test-on.sh SUITE [--tree paraview|vtk] [--no-demo | --no-tests] [--compiler-cache] [--keep] [-j N]
  SUITE             bookworm, trixie, sid (Debian) or noble (Ubuntu)
  --tree TREE       tests of one tree only
  --no-demo         scripts/test.sh alone
  --no-tests        scripts/demo.sh alone
  --compiler-cache  keep compiled files for the next run on that suite (the times are not those of a new machine then)
  --keep            leave the system where it is, to look at it (its place is said)
  -j N              parallel jobs (default: all cores)
Runs as root. Needs debootstrap; DYNAMICCORONARY_MIRROR names another mirror than deb.debian.org or archive.ubuntu.com.
The log is build/logs/test-on-SUITE.log.
EOF
}

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
# shellcheck source=scripts/build-first.bash
source "$root/scripts/build-first.bash"
# shellcheck source=scripts/pristine-system.bash
source "$root/scripts/pristine-system.bash"
suite=""
demo=yes
tests=yes
keep=no
compiler_cache=no
of_tests=()
while [ $# -gt 0 ]; do
  taken=1
  case "$1" in
    --tree)
      of_tests=(--tree "${2:-}")
      taken=$(($# > 1 ? 2 : 1))
      ;;
    --tree=*) of_tests=("$1") ;;
    --no-demo) demo=no ;;
    --no-tests) tests=no ;;
    --compiler-cache) compiler_cache=yes ;;
    --keep) keep=yes ;;
    [!-]*)
      [ -z "$suite" ] || refuse_option "$1"
      suite="$1"
      ;;
    *) build_option "$@" || refuse_option "$1" ;;
  esac
  shift "$taken"
done
case "$suite" in
  bookworm | trixie | sid | noble) ;;
  "")
    usage >&2
    exit 2
    ;;
  *)
    echo "test-on: bookworm, trixie, sid or noble, not '$suite'" >&2
    exit 2
    ;;
esac
require_debootstrap

mkdir -p "$root/build/logs"
log="$root/build/logs/test-on-$suite.log"
: >"$log"
pristine_system "$suite" "$log"
finish() {
  if [ "$keep" = yes ]; then
    echo "The system is left in $system"
  else
    rm -rf "$system"
  fi
}
trap finish EXIT
place=/home/dynamiccoronary
git clone -q "$root" "$system$place"
commit="$(git -C "$system$place" rev-parse --short HEAD)"

commands=()
if [ "$demo" = yes ]; then
  commands+=("scripts/demo.sh -j $jobs")
fi
if [ "$tests" = yes ]; then
  commands+=("scripts/test.sh ${of_tests[*]} -j $jobs")
fi
mounts=()
if [ -d "$root/../shared" ]; then
  mounts+=("$root/../shared=/home/shared")
fi
if [ "$compiler_cache" = yes ]; then
  mkdir -p "$systems/$suite-ccache"
  mounts+=("$systems/$suite-ccache=/root/.cache/ccache")
fi
echo "== $suite, commit $commit: $(sed -n 's/^PRETTY_NAME="\(.*\)"/\1/p' "$system/etc/os-release")"
failed=()
for command in "${commands[@]}"; do
  begun="$SECONDS"
  echo "== $command" | tee -a "$log"
  in_system "cd $place && $command" ${mounts[@]+"${mounts[@]}"} 2>&1 | tee -a "$log" || failed+=("${command%% *}")
  passed=$((SECONDS - begun))
  printf '== %s: %d:%02d min\n' "${command%% *}" $((passed / 60)) $((passed % 60)) | tee -a "$log"
done
if [ ${#failed[@]} -gt 0 ]; then
  echo "FAILED on $suite, commit $commit: ${failed[*]}"
  exit 1
fi
echo "Passed on $suite, commit $commit"
