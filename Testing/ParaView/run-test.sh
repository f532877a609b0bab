#!/bin/sh
# run-test.sh <work folder> <command ...>
#   Runs a test of ParaView with a display and a home folder of its own; 125, which CTest takes
#   as skipped, where there is no Xvfb.
set -eu
work="$1"
shift

if ! command -v Xvfb >/dev/null; then
  echo "skipped: Xvfb is missing"
  exit 125
fi

# The user's settings must not change the result, nor the test the user's settings.
mkdir -p "$work/home/config/ParaView"
HOME="$work/home"
XDG_CONFIG_HOME="$work/home/config"
export HOME XDG_CONFIG_HOME
unset PV_PLUGIN_PATH PV_PLUGIN_CONFIG_FILE

# Nothing is written into the source folder.
export PYTHONDONTWRITEBYTECODE=1
# Open MPI refuses root, and more ranks than cores, unless told; in a container it may not read the
# memory of its neighbour.
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
export OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_btl_vader_single_copy_mechanism=none
# Its daemon asks every X server of the machine for graphics cards, and dies with one that is just going: another test's.
export HWLOC_COMPONENTS=-gl

cd "$work"

# Not through xvfb-run: it looks for a free display number itself, which two tests at once do at the
# same time, and waits three seconds for the server, which a busy machine does not keep. The server
# takes a number of its own and tells it when it is ready. It must not reset itself when its last
# client leaves (a window closed before the next one is opened): the reset drops whoever connects
# meanwhile, one connection of ten, and ParaView aborts.
rm -f display
mkfifo display
Xvfb -displayfd 3 -screen 0 1600x1000x24 -nolisten tcp -noreset 3>display 2>server.log &
server=$!
# Waited for: a server that is still going takes the socket of the next one of its number with it.
trap 'kill "$server" 2>/dev/null || true; wait "$server" 2>/dev/null || true' EXIT
trap 'exit 143' INT TERM HUP
number=
read -r number <display || true
if [ -z "$number" ]; then
  echo "Xvfb did not start:" >&2
  cat server.log >&2
  exit 1
fi
DISPLAY=":$number"
export DISPLAY
unset XAUTHORITY
"$@"
