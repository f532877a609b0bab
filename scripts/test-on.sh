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
  bookworm | trixie | sid) mirror="${DYNAMICCORONARY_MIRROR:-http://deb.debian.org/debian}" ;;
  noble) mirror="${DYNAMICCORONARY_MIRROR:-http://archive.ubuntu.com/ubuntu}" ;;
  "")
    usage >&2
    exit 2
    ;;
  *)
    echo "test-on: bookworm, trixie, sid or noble, not '$suite'" >&2
    exit 2
    ;;
esac
if [ "$(id -u)" -ne 0 ]; then
  echo "test-on: run me as root: a system of its own is entered by chroot" >&2
  exit 1
fi
if ! command -v debootstrap >/dev/null; then
  echo "test-on: debootstrap is missing (apt-get install debootstrap)" >&2
  exit 1
fi

cache="${XDG_CACHE_HOME:-${HOME:-/root}/.cache}/dynamiccoronary/systems"
base="$cache/$suite"
mkdir -p "$cache" "$root/build/logs"
log="$root/build/logs/test-on-$suite.log"
: >"$log"

if [ ! -d "$base" ]; then
  echo "== A base system of $suite, once (log: build/logs/test-on-$suite.log)"
  made="$(mktemp -d "$cache/$suite.XXXXXX")"
  trap 'rm -rf "$made"' EXIT
  options=("--variant=minbase" "--include=git,ca-certificates")
  if [ "$suite" = noble ]; then
    options+=("--components=main,universe")
    # Debian has no key of Ubuntu's archive unless ubuntu-keyring is installed.
    [ -f /usr/share/keyrings/ubuntu-archive-keyring.gpg ] || options+=(--no-check-gpg)
  fi
  if ! debootstrap "${options[@]}" "$suite" "$made/root" "$mirror" >>"$log" 2>&1; then
    tail -n 20 "$log" >&2
    echo "test-on: debootstrap could not make a system of $suite" >&2
    exit 1
  fi
  mv -T "$made/root" "$base"
  rmdir "$made"
  trap - EXIT
fi

system="$(mktemp -d "$cache/$suite-run.XXXXXX")"
finish() {
  if [ "$keep" = yes ]; then
    echo "The system is left in $system"
  else
    rm -rf "$system"
  fi
}
trap finish EXIT
cp -a "$base/." "$system"
cp -L /etc/resolv.conf "$system/etc/resolv.conf"
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
# The mounts are in a name space of their own: they are gone with its last process, whatever happens.
# shellcheck disable=SC2016 # for the shell inside
inside='
set -eu
system=$1 place=$2 kept=$3
mount -t proc proc "$system/proc"
mount --rbind /dev "$system/dev"
mount --rbind /sys "$system/sys"
if [ -d "$4" ]; then
  mkdir -p "$system/home/shared"
  mount --bind "$4" "$system/home/shared"
fi
if [ -n "$kept" ]; then
  mkdir -p "$kept" "$system/root/.cache/ccache"
  mount --bind "$kept" "$system/root/.cache/ccache"
fi
exec chroot "$system" env -i HOME=/root PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 \
  sh -c "cd $place && $5"
'
kept=""
if [ "$compiler_cache" = yes ]; then
  kept="$cache/$suite-ccache"
fi
echo "== $suite, commit $commit: $(sed -n 's/^PRETTY_NAME="\(.*\)"/\1/p' "$base/etc/os-release")"
failed=()
for command in "${commands[@]}"; do
  begun="$SECONDS"
  echo "== $command" | tee -a "$log"
  unshare --mount --pid --fork --kill-child sh -c "$inside" test-on "$system" "$place" "$kept" "$root/../shared" "$command" \
    </dev/null 2>&1 | tee -a "$log" || failed+=("${command%% *}")
  passed=$((SECONDS - begun))
  printf '== %s: %d:%02d min\n' "${command%% *}" $((passed / 60)) $((passed % 60)) | tee -a "$log"
done
if [ ${#failed[@]} -gt 0 ]; then
  echo "FAILED on $suite, commit $commit: ${failed[*]}"
  exit 1
fi
echo "Passed on $suite, commit $commit"
