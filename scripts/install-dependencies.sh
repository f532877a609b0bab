#!/usr/bin/env bash
# Installs the Debian packages that DynamicCoronary is configured, built and tested with.
set -euo pipefail

usage() {
  cat <<'EOF'
Usage: scripts/install-dependencies.sh [--check] [--tree paraview|vtk] [--no-tests] [--nightly] [--developer] [--flow]
  --check      change nothing; name what is missing and exit 1, exit 0 when all is there
  --tree TREE  packages of one tree only (both without this option)
  --no-tests   without the browser and what else only tests use
  --nightly    Google's benchmark library, ITK and elastix, which are compared with, and what runs the notebook, as well
  --developer  what --nightly adds, and clang, valgrind, heaptrack, clang-tidy, shellcheck
  --flow       OpenFOAM as well, for scripts/demo-flow.sh and scripts/validate-flow.py
Runs as root, or through sudo. Run again, it changes nothing.
EOF
}

# What differs between the systems. DYNAMICCORONARY_SUITE names another one, for --check.
suite="${DYNAMICCORONARY_SUITE:-$(sed -n 's/^VERSION_CODENAME=//p' /etc/os-release 2>/dev/null || true)}"
known="Debian 12 (bookworm), 13 (trixie) and unstable (forky), and Ubuntu 24.04 (noble)"
tetgen=libtet1.5-dev
qt5=(libqt5svg5 libqt5opengl5-dev qttools5-dev qtxmlpatterns5-dev-tools)
qt6=(qt6-svg-plugins qt6-base-dev qt6-5compat-dev qt6-tools-dev libpython3-dev)
# VTK can not be installed beside python3-paraview where ParaView brings its own: scripts/vtk-prefix.sh unpacks it into a
# folder of its own, and these are what its libraries load.
vtk=(libpython3-dev libtbb-dev libjsoncpp-dev libdouble-conversion3 libexpat1 liblz4-1 liblzma5 libtiff6 patchelf)
browser=(chromium nodejs)
clang=(clang clang-tidy libclang-rt-dev)
vtk_alone=yes
case "$suite" in
  bookworm)
    qt=("${qt5[@]}")
    vtk+=(libjpeg62-turbo libopenmpi3 libpng16-16)
    clang=(clang clang-tidy-14 libclang-rt-14-dev)
    browser+=(clang-format-14)
    ;;
  trixie)
    qt=("${qt6[@]}")
    vtk+=(libjpeg62-turbo libopenmpi40 libpng16-16t64)
    ;;
  forky | sid)
    qt=("${qt6[@]}" libvtk9-dev libvtk9-qt-dev xsltproc)
    vtk=(libvtk9-dev python3-vtk9 libpython3-dev)
    tetgen=libtet-dev
    vtk_alone=no
    ;;
  noble)
    qt=("${qt5[@]}")
    vtk+=(libjpeg-turbo8 libopenmpi3t64 libpng16-16t64)
    # Ubuntu has the browser as a snap only.
    browser=(nodejs)
    ;;
  *)
    qt=()
    ;;
esac

# Build, repeated builds, faster linking. Linear algebra: Eigen; AMD's order for the skin weights' equations: SuiteSparse.
# DICOM pixels: GDCM; compressed images: zlib; XML: Expat; JSON; command lines: CLI11; X-ray attenuation: xraylib.
# Optional: the mesher's workers TetGen and CGAL (which also tests the Hausdorff distance), animated pictures: giflib, game
# controllers: libevdev, 3D Slicer: OpenIGTLink. FreeType, GLEW and X11 are what VTK's CMake files ask for.
# dpkg-dev and file: cpack finds what the package depends on.
common=(
  g++ cmake ninja-build ccache mold
  libeigen3-dev libsuitesparse-dev libgdcm-dev zlib1g-dev libexpat1-dev nlohmann-json3-dev libcli11-dev "$tetgen"
  libcgal-dev libxrl-dev
  libfreetype-dev libgif-dev libglew-dev libx11-dev
  xvfb xauth
  dpkg-dev file python3
  pkg-config libevdev-dev libopenigtlink-dev
)
# ParaView's headers need MPI; Qt: help pages, icons (blank without the SVG plugin), and the simulator's window.
paraview=(paraview-dev python3-paraview libopenmpi-dev libdouble-conversion-dev "${qt[@]}")
# For tests; without those after the first two some are skipped: clicks in the window; the review page; a validator of glTF
# that is fetched; X-ray projections.
tests=(libgtest-dev libxtst6 "${browser[@]}" curl ca-certificates plastimatch)
nightly=(libbenchmark-dev libinsighttoolkit5-dev elastix python3-nbconvert python3-ipykernel python3-matplotlib)
# scripts/fuzz.sh, scripts/lint.sh, scripts/check-leaks.sh.
developer=("${clang[@]}" valgrind heaptrack shellcheck)
flow=(openfoam python3-numpy python3-matplotlib)

check_only=no
tree=all
with_developer=no
with_tests=yes
with_nightly=no
with_flow=no
while [ $# -gt 0 ]; do
  case "$1" in
    --check) check_only=yes ;;
    --tree)
      tree="${2:-}"
      shift || true
      ;;
    --tree=*) tree="${1#*=}" ;;
    --no-tests) with_tests=no ;;
    --nightly) with_nightly=yes ;;
    --developer) with_developer=yes ;;
    --flow) with_flow=yes ;;
    -h | --help)
      usage
      exit 0
      ;;
    *)
      echo "install-dependencies: unknown option '$1'" >&2
      usage >&2
      exit 2
      ;;
  esac
  shift || true
done

case "$tree" in
  all) wanted=("${common[@]}" "${paraview[@]}" "${vtk[@]}") ;;
  paraview) wanted=("${common[@]}" "${paraview[@]}") ;;
  vtk) wanted=("${common[@]}" "${vtk[@]}") ;;
  *)
    echo "install-dependencies: --tree takes paraview or vtk, not '$tree'" >&2
    exit 2
    ;;
esac
if [ "$with_tests" = yes ]; then
  wanted+=("${tests[@]}")
fi
if [ "$with_flow" = yes ]; then
  wanted+=("${flow[@]}")
fi
if [ "$with_nightly" = yes ] || [ "$with_developer" = yes ]; then
  wanted+=("${nightly[@]}")
fi
if [ "$with_developer" = yes ]; then
  wanted+=("${developer[@]}")
fi

mapfile -t wanted < <(printf '%s\n' "${wanted[@]}" | awk '!seen[$0]++')

if [ ${#qt[@]} -eq 0 ] || ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
  {
    echo "install-dependencies: '${suite:-a system without a name}' is not known here: $known are. Install the counterparts of:" \
      "${wanted[*]} (and Qt's development files)."
  } >&2
  exit 1
fi

is_installed() {
  # "|| true": dpkg-query fails for a package that it has never heard of.
  [ "$(dpkg-query -W -f '${db:Status-Status}' "$1" 2>/dev/null || true)" = installed ]
}

list_missing() {
  local package
  for package in "${wanted[@]}"; do
    if ! is_installed "$package"; then
      echo "$package"
    fi
  done
}

mapfile -t missing < <(list_missing)
if [ ${#missing[@]} -eq 0 ]; then
  echo "Nothing to install: all ${#wanted[@]} packages are there."
  exit 0
fi
# apt would remove what others work with, or stop with a page of reasons.
if [ "$vtk_alone" = yes ] && [[ " ${missing[*]} " == *" python3-paraview "* ]] && is_installed python3-vtk9; then
  echo "install-dependencies: python3-paraview, which is needed, and python3-vtk9, which is installed, exclude each other" \
    "in Debian: remove python3-vtk9 (apt-get remove python3-vtk9), or build without ParaView (--tree vtk)." >&2
  exit 1
fi
if [ "$check_only" = yes ]; then
  echo "Missing packages: ${missing[*]}"
  exit 1
fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo >/dev/null; then
    echo "install-dependencies: run me as root (there is no sudo). Missing: ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
  # Without a terminal nobody can type a password: fail at once instead of waiting.
  if [ ! -t 0 ]; then
    as_root=(sudo -n)
    if ! sudo -n true 2>/dev/null; then
      echo "install-dependencies: sudo asks for a password. Run me as root. Missing: ${missing[*]}" >&2
      exit 1
    fi
  fi
fi

apt_options=(-o DPkg::Lock::Timeout=300 -o Acquire::Retries=3)
echo "Installing: ${missing[*]}"
if ! "${as_root[@]}" apt-get "${apt_options[@]}" -qq update; then
  echo "install-dependencies: 'apt-get update' failed; trying with the package lists of before." >&2
fi

unavailable=()
for package in "${missing[@]}"; do
  policy="$(LC_ALL=C apt-cache policy "$package")"
  if [[ $policy != *"Candidate: "[!\(]* ]]; then
    unavailable+=("$package")
  fi
done
if [ ${#unavailable[@]} -gt 0 ]; then
  echo "install-dependencies: no apt source offers: ${unavailable[*]}" >&2
  exit 1
fi

# --no-remove: apt would silently take away what is in the way of a package, from whoever works with it.
log="$(mktemp)"
trap 'rm -f "$log"' EXIT
if ! "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
  apt-get "${apt_options[@]}" -y --no-remove --no-install-recommends install "${missing[@]}" \
  </dev/null >"$log" 2>&1; then
  tail -n 30 "$log" >&2
  echo "install-dependencies: apt-get could not install: ${missing[*]}" >&2
  exit 1
fi

mapfile -t missing < <(list_missing)
if [ ${#missing[@]} -gt 0 ]; then
  echo "install-dependencies: still missing after the installation: ${missing[*]}" >&2
  exit 1
fi
echo "Installed; all ${#wanted[@]} packages are there."
