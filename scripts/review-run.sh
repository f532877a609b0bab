#!/usr/bin/env bash
# Straightened views, thin slabs and the review page of any run; installs and builds first what is missing.
set -euo pipefail

usage() {
  cat <<'EOF_USAGE'
Usage: scripts/review-run.sh [--no-install] [-j N] RUN [options of coronary-pipeline review ...]
  --no-install  use what is installed
  -j N          parallel jobs of the build (default: all cores)
RUN is a folder that coronary-pipeline run wrote, with a centerline at least. For example
  scripts/review-run.sh demo-output/run                     # writes demo-output/run/review
  scripts/review-run.sh case7/run --image /data/case7 --output case7/review
EOF_USAGE
}

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
# shellcheck source=scripts/build-first.bash
source "$root/scripts/build-first.bash"
while [ $# -gt 0 ] && build_option "$@"; do
  shift "$taken"
done
if [ $# -eq 0 ]; then
  usage >&2
  exit 2
fi

folder="$PWD"
cd "$root"
install_and_build build/logs/review-build.log --target coronary-pipeline </dev/null
cd "$folder"
exec "$root/build/paraview/bin/coronary-pipeline" review "$@"
