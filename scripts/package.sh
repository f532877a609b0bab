#!/usr/bin/env bash
# Builds dynamiccoronary_VERSION_ARCHITECTURE.deb: plugin, programs, libraries, headers, documentation.
set -euo pipefail

usage() {
  cat <<'EOF'
Usage: scripts/package.sh [--no-install] [-j N]
  --no-install   use what is installed
  -j N           parallel jobs of the build (default: all cores)
The package is left in build/packages.
EOF
}

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
install=yes
jobs="$(nproc)"
while [ $# -gt 0 ]; do
  case "$1" in
    --no-install) install=no ;;
    -j)
      jobs="${2:-}"
      shift || true
      ;;
    -j*) jobs="${1#-j}" ;;
    -h | --help)
      usage
      exit 0
      ;;
    *)
      echo "package: unknown option '$1'" >&2
      usage >&2
      exit 2
      ;;
  esac
  shift || true
done
if ! [[ $jobs =~ ^[1-9][0-9]*$ ]]; then
  echo "package: -j takes a number of jobs, not '$jobs'" >&2
  exit 2
fi

exec </dev/null
cd "$root"
if [ "$install" = yes ]; then
  scripts/install-dependencies.sh --tree paraview --no-tests
fi
mkdir -p build/logs
log="$root/build/logs/package.log"
echo "== Building (log: build/logs/package.log)"
if ! { cmake --preset paraview && cmake --build --preset paraview -j "$jobs" \
  && cpack --config build/paraview/CPackConfig.cmake -B build/packages; } >"$log" 2>&1; then
  tail -n 40 "$log" >&2
  exit 1
fi
rm -rf build/packages/_CPack_Packages
ls "$root"/build/packages/*.deb
