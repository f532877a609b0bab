#!/usr/bin/env bash
# Starts the simulator's window on the built-in phantom; installs and builds first what is missing.
set -euo pipefail

usage() {
  cat <<'EOF'
Usage: scripts/simulate.sh [--no-install] [-j N] [options of coronary-simulator ...]
  --no-install  use what is installed
  -j N          parallel jobs of the build (default: all cores)
Everything else goes to coronary-simulator, for example
  scripts/simulate.sh --scenario phantom-rca
  scripts/simulate.sh --vessels demo-output/run             # the model that scripts/demo.sh made
  scripts/simulate.sh --device serial:/dev/ttyACM0
  scripts/simulate.sh --replay Testing/Data/Driving/lad-apex.pcirec
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
    *) break ;;
  esac
  shift || true
done
if ! [[ $jobs =~ ^[1-9][0-9]*$ ]]; then
  echo "simulate: -j takes a number of jobs, not '$jobs'" >&2
  exit 2
fi

folder="$PWD"
cd "$root"
mkdir -p build/logs
if [ "$install" = yes ]; then
  echo "== Packages"
  scripts/install-dependencies.sh --tree paraview --no-tests </dev/null
fi
echo "== Building (log: build/logs/simulate-build.log)"
if ! { cmake --preset paraview && cmake --build --preset paraview -j "$jobs" --target coronary-simulator; } \
  >build/logs/simulate-build.log 2>&1 </dev/null; then
  tail -n 40 build/logs/simulate-build.log >&2
  exit 1
fi
cd "$folder"
exec "$root/build/paraview/bin/coronary-simulator" "$@"
