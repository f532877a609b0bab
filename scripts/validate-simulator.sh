#!/usr/bin/env bash
# The simulator's physics, contrast medium and X-ray images against closed forms (docs/simulator.md, contrast.md,
# fluoroscopy.md, fluoroscopy-image.md), and random driving in beating phantoms.
set -euo pipefail

usage() {
  cat <<'TEXT'
Usage: scripts/validate-simulator.sh [--quick] [BUILD_FOLDER]
  --quick       without the soak: 20 phantoms of 50,000 ticks take five to ten minutes
  BUILD_FOLDER  default: build/paraview
Prints the tables of the rod, of contrast medium and of X-ray images, and that of the soak as CSV. Exit code 1 when anything misses its limit.
TEXT
}

quick=no
build=""
for argument in "$@"; do
  case "$argument" in
    --quick) quick=yes ;;
    -h | --help)
      usage
      exit 0
      ;;
    -*)
      echo "validate-simulator: unknown option '$argument'" >&2
      exit 2
      ;;
    *) build="$argument" ;;
  esac
done
build="${build:-$(dirname "${BASH_SOURCE[0]}")/../build/paraview}"
tests=(UnitTestCosseratRod UnitTestGuideInAorta UnitTestBalloon UnitTestStent UnitTestOcclusion UnitTestMicrocatheter UnitTestWireInGuide UnitTestCoronaryFlow UnitTestIschaemia UnitTestVesselTears UnitTestContrastTracers UnitTestContrastModel UnitTestCArm
  UnitTestAttenuation UnitTestXRayProjectors UnitTestDetector UnitTestAcquisition UnitTestExposureControl UnitTestMovingParts UnitTestThoraxPhantom)
soak="$build/bin/soak-intervention"
if [ ! -x "$soak" ]; then
  echo "validate-simulator: $soak is not there; build first (README.md)" >&2
  exit 1
fi

log="$(mktemp)"
trap 'rm -f "$log"' EXIT
status=0
echo "| test | closed form | measured | off by | tolerance |"
echo "|---|---|---|---|---|"
for test in "${tests[@]}"; do
  failed=no
  ctest --test-dir "$build" -R "^$test(-|\$)" --no-tests=error -V >"$log" 2>&1 || failed=yes
  sed -n 's/^[0-9]*: |/|/p' "$log" | grep . || failed=yes
  if [ "$failed" = yes ]; then
    status=1
    grep -A3 'Failure' "$log" >&2 || true
  fi
done
if [ "$quick" = no ]; then
  echo
  "$soak" 20 50000 || status=1
fi
exit "$status"
