#!/usr/bin/env bash
# Pictures of the ParaView window with the plugin's menu and examples, for docs/paraview.md. Needs Xvfb and ParaView.
set -euo pipefail

usage() {
  cat <<'EOF'
Usage: scripts/render-paraview.sh OUTPUT [SERIES]
  OUTPUT  folder for paraview-*.png
  SERIES  series.json or another file to build from; default: the small phantom that the menu makes
The plugin is taken from build/paraview, or from the folder that PLUGIN names.
EOF
}

if [ $# -lt 1 ] || [ $# -gt 2 ]; then
  usage >&2
  exit 2
fi
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
plugin="${PLUGIN:-$(echo "$root"/build/paraview/lib/paraview-*/plugins/DynamicCoronaryPlugin)}"
mkdir -p "$1"
work="$(mktemp -d)"
PICTURES="$(cd "$1" && pwd)"
SERIES="${2:+$(realpath "$2")}"
SCREEN="$work"
# The user's settings neither change the pictures, nor are changed.
HOME="$work/home"
XDG_CONFIG_HOME="$work/home"
TESTING="$root/Testing/ParaView"
DYNAMICCORONARY_TEST_FOLDER="$work"
export PICTURES SERIES SCREEN HOME XDG_CONFIG_HOME TESTING DYNAMICCORONARY_TEST_FOLDER
mkdir -p "$HOME"

shell='pqClientMainWindow/pythonShellDock/pythonShell/consoleWidget'
menu='pqClientMainWindow/menubar'
python() {
  echo "<pqevent object=\"$shell\" command=\"executeCommand\" arguments=\"$1&#xA;\" />"
}
click() {
  echo "<pqevent object=\"pqClientMainWindow/menuDynamicCoronary\" command=\"activate\" arguments=\"$1\" />"
}
{
  echo '<?xml version="1.0" ?><pqevents>'
  python "exec(open('$root/scripts/render-paraview.py').read())"
  echo "<pqevent object=\"$menu\" command=\"activate\" arguments=\"menuDynamicCoronary\" />"
  python "grab('menu')"
  for example in Phantom Review Posing Export; do
    click "coronary$example"
    python "grab('${example,,}'); clear()"
  done
  python "open_series()"
  click coronaryBuild
  echo '<pqevent object="pqClientMainWindow/coronaryBuildWindow/start" command="activate" arguments="" />'
  python "wait()"
  python "grab('build')"
  echo '</pqevents>'
} >"$work/play.xml"

mkfifo "$work/display"
Xvfb -displayfd 3 -screen 0 1400x860x24 -fbdir "$work" -nolisten tcp -noreset 3>"$work/display" 2>"$work/server.log" &
server=$!
trap 'kill "$server" 2>/dev/null || true; wait "$server" 2>/dev/null || true; rm -rf "$work"' EXIT
read -r number <"$work/display"
DISPLAY=":$number"
export DISPLAY
unset XAUTHORITY
paraview -qwindowgeometry 1400x860+0+0 --dr "--plugin-search-paths=$plugin" --plugins=DynamicCoronaryPlugin \
  "--test-directory=$work" "--test-script=$work/play.xml" --exit
ls "$PICTURES"/paraview-*.png
