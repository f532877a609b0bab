#!/usr/bin/env bash
# Prints the folder of a plain VTK 9.1's CMake package (for VTK_DIR), and makes it when missing.
#
# Debian's libvtk9-dev can not be installed beside python3-paraview, so its packages (28 MB) are
# unpacked into ~/.cache/dynamiccoronary/vtk-9.1. Not into the build folder: what is installed
# from the vtk tree must still find its VTK when the checkout is gone, and CMake keeps no run path
# that leads into the source tree.
set -euo pipefail

packages=(libvtk9-dev libvtk9.1 python3-vtk9)

if [ -n "${DYNAMICCORONARY_VTK_DIR:-}" ]; then
  echo "$DYNAMICCORONARY_VTK_DIR"
  exit 0
fi

triplet="$(gcc -print-multiarch 2>/dev/null || true)"
triplet="${triplet:-x86_64-linux-gnu}"
installed="/usr/lib/$triplet/cmake/vtk-9.1"
if [ -f "$installed/vtk-config.cmake" ] \
  && [ "$(dpkg-query -W -f '${db:Status-Status}' libvtk9-dev 2>/dev/null || true)" = installed ]; then
  echo "$installed"
  exit 0
fi

cache="${XDG_CACHE_HOME:-${HOME:-$(cd ~ && pwd)}/.cache}/dynamiccoronary"
prefix="$cache/vtk-9.1"
if [ -f "$prefix/usr/lib/$triplet/cmake/vtk-9.1/vtk-config.cmake" ]; then
  echo "$prefix/usr/lib/$triplet/cmake/vtk-9.1"
  exit 0
fi

for tool in apt-get dpkg patchelf; do
  if ! command -v "$tool" >/dev/null; then
    echo "vtk-prefix: '$tool' is missing; run scripts/install-dependencies.sh" >&2
    exit 1
  fi
done

mkdir -p "$cache"
work="$(mktemp -d "$cache/vtk-9.1.XXXXXX")"
trap 'rm -rf "$work"' EXIT

fetch() {
  # As root apt drops its rights for downloads, and could then not write here.
  (cd "$work" && apt-get -qq -o APT::Sandbox::User="$(id -un)" -o Acquire::Retries=3 \
    download "${packages[@]}") >&2
}
if ! fetch; then
  # A machine that had nothing to install may never have read the package lists.
  echo "vtk-prefix: reading apt's package lists first" >&2
  if [ "$(id -u)" -eq 0 ]; then
    apt-get -qq -o DPkg::Lock::Timeout=300 update >&2 </dev/null
  elif command -v sudo >/dev/null; then
    sudo -n apt-get -qq -o DPkg::Lock::Timeout=300 update >&2 </dev/null
  else
    echo "vtk-prefix: run 'apt-get update' as root first" >&2
    exit 1
  fi
  fetch
fi

for package in "$work"/*.deb; do
  dpkg -x "$package" "$work/prefix"
done
# The libraries look for each other in the system's folders; here they must look beside themselves.
for library in "$work/prefix/usr/lib/$triplet"/libvtk*.so.*; do
  if [ ! -L "$library" ]; then
    # shellcheck disable=SC2016 # $ORIGIN is for the dynamic linker
    patchelf --set-rpath '$ORIGIN' "$library"
  fi
done
chmod 755 "$work/prefix"
# Whole or not at all: the folder gets its name when it is complete.
if ! mv -T "$work/prefix" "$prefix" 2>/dev/null; then
  rm -rf "$prefix"
  mv -T "$work/prefix" "$prefix"
fi
echo "$prefix/usr/lib/$triplet/cmake/vtk-9.1"
