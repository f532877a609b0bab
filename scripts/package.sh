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
# shellcheck source=scripts/build-first.bash
source "$root/scripts/build-first.bash"
while [ $# -gt 0 ]; do
  build_option "$@" || refuse_option "$1"
  shift "$taken"
done

exec </dev/null
cd "$root"
log=build/logs/package.log
install_and_build "$log"
if ! cpack --config build/paraview/CPackConfig.cmake -B build/packages >>"$log" 2>&1; then
  tail -n 40 "$log" >&2
  exit 1
fi
rm -rf build/packages/_CPack_Packages
ls "$root"/build/packages/*.deb
