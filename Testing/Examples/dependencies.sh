#!/usr/bin/env bash
# What scripts/install-dependencies.sh says of a Debian where ParaView's Python and VTK's are in each other's way: one sentence,
# and nothing is installed. dpkg-query is played by a script.
set -euo pipefail
script="$(cd "$(dirname "$0")/../.." && pwd)/scripts/install-dependencies.sh"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
# Where this runs they may well go together, as on unstable.
export DYNAMICCORONARY_SUITE=bookworm
cat >"$work/dpkg-query" <<'EOF'
#!/bin/sh
for package; do :; done
case "$package" in python3-paraview) exit 1 ;; esac
printf installed
EOF
cat >"$work/apt-get" <<'EOF'
#!/bin/sh
echo "apt-get was called" >&2
exit 1
EOF
chmod +x "$work/dpkg-query" "$work/apt-get"

for options in "" "--check"; do
  code=0
  # shellcheck disable=SC2086 # none or one
  said="$(PATH="$work:$PATH" "$script" $options 2>&1)" || code=$?
  lines="$(printf '%s\n' "$said" | wc -l)"
  if [ "$code" -ne 1 ] || [ "$lines" -ne 1 ] ||
    ! [[ $said == *python3-paraview*python3-vtk9*"exclude each other"*"apt-get remove python3-vtk9"* ]]; then
    echo "FAILED: 'install-dependencies $options' ends with $code and says: $said"
    exit 1
  fi
done
# Without ParaView nothing is in the way.
PATH="$work:$PATH" "$script" --tree vtk --check
