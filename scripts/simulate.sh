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
# shellcheck source=scripts/build-first.bash
source "$root/scripts/build-first.bash"
while [ $# -gt 0 ] && build_option "$@"; do
  shift "$taken"
done

folder="$PWD"
cd "$root"
install_and_build build/logs/simulate-build.log --target coronary-simulator </dev/null
cd "$folder"
exec "$root/build/paraview/bin/coronary-simulator" "$@"
