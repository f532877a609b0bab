#!/bin/sh
# readme-window.sh <README.md> <build tree> <paraview> <arguments ...>
#   Starts the window by the lines of README, in this build tree, with these arguments more.
set -eu
readme="$1"
build="$2"
paraview="$3"
shift 3
lines="$(awk '/PV_PLUGIN_CONFIG_FILE=/ { on = 1 } /^`/ { on = 0 } on' "$readme")"
if [ "$(printf '%s\n' "$lines" | tail -n 1)" != paraview ]; then
  echo "FAILED: README does not start paraview by two lines, but by: $lines"
  exit 1
fi
export_line="$(printf '%s\n' "$lines" | head -n 1 | sed "s|\$PWD/build/paraview|$build|")"
eval "$export_line"
"$paraview" "$@"
