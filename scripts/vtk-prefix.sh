#!/usr/bin/env bash
# Prints the folder of a plain VTK's CMake package (for VTK_DIR), and makes it when missing.
#
# Where libvtk9-dev can not be installed beside python3-paraview (Debian 12 and 13), its packages (28 MB) are
# unpacked into ~/.cache/dynamiccoronary/vtk-9.N. Not into the build folder: what is installed
# from the vtk tree must still find its VTK when the checkout is gone, and CMake keeps no run path
# that leads into the source tree.
set -euo pipefail

if [ -n "${DYNAMICCORONARY_VTK_DIR:-}" ]; then
  echo "$DYNAMICCORONARY_VTK_DIR"
  exit 0
fi

triplet="$(gcc -print-multiarch 2>/dev/null || true)"
triplet="${triplet:-x86_64-linux-gnu}"
is_installed="$(dpkg-query -W -f '${db:Status-Status}' libvtk9-dev 2>/dev/null || true)"
for installed in /usr/lib/"$triplet"/cmake/vtk-9.*; do
  if [ "$is_installed" = installed ] && [ -f "$installed/vtk-config.cmake" ]; then
    echo "$installed"
    exit 0
  fi
done

cache="${XDG_CACHE_HOME:-${HOME:-$(cd ~ && pwd)}/.cache}/dynamiccoronary"

read_lists() {
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
}

# "9.1": which VTK this system has.
offered() {
  LC_ALL=C apt-cache policy libvtk9-dev 2>/dev/null | sed -nE 's/^ *Candidate: ([0-9]+\.[0-9]+)\..*/\1/p'
}
version="$(offered)"
if [ -z "$version" ]; then
  read_lists
  version="$(offered)"
fi
if [ -z "$version" ]; then
  echo "vtk-prefix: no apt source offers libvtk9-dev" >&2
  exit 1
fi
packages=(libvtk9-dev "libvtk$version" python3-vtk9 vtk9)
prefix="$cache/vtk-$version"
folder="$prefix/usr/lib/$triplet/cmake/vtk-$version"
wrapper="$prefix/usr/bin/vtkWrapHierarchy-$version"
if [ -f "$folder/vtk-config.cmake" ] && [ -f "$wrapper" ]; then
  echo "$folder"
  exit 0
fi

for tool in apt-get dpkg file patchelf; do
  if ! command -v "$tool" >/dev/null; then
    echo "vtk-prefix: '$tool' is missing; run scripts/install-dependencies.sh" >&2
    exit 1
  fi
done

mkdir -p "$cache"
work="$(mktemp -d "$cache/vtk-$version.XXXXXX")"
trap 'rm -rf "$work"' EXIT

fetch() {
  # As root apt drops its rights for downloads, and could then not write here.
  (cd "$work" && apt-get -qq -o APT::Sandbox::User="$(id -un)" -o Acquire::Retries=3 \
    download "${packages[@]}") >&2
}
if ! fetch; then
  read_lists
  fetch
fi

for package in "$work"/*.deb; do
  dpkg -x "$package" "$work/prefix"
done
# Libraries, Python's modules and programs look for the libraries in the system's folders; here they must look beside themselves.
look_in() {
  local folder="$1" file
  shift
  for file in "$@"; do
    if [ ! -L "$file" ] && file -b "$file" | grep -q '^ELF .*dynamically linked'; then
      patchelf --set-rpath "\$ORIGIN/$folder" "$file"
    fi
  done
}
look_in . "$work/prefix/usr/lib/$triplet"/libvtk*.so.*
look_in "../../../$triplet" "$work/prefix/usr/lib/python3/dist-packages/vtkmodules"/*.so
look_in "../lib/$triplet" "$work/prefix/usr/bin"/*
chmod 755 "$work/prefix"
# Whole or not at all: the folder gets its name when it is complete.
if ! mv -T "$work/prefix" "$prefix" 2>/dev/null; then
  rm -rf "$prefix"
  mv -T "$work/prefix" "$prefix"
fi
echo "$folder"
