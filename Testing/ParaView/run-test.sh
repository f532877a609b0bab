#!/bin/sh
# run-test.sh <work folder> <command ...>
#   Runs a test of ParaView with a display and a home folder of its own; 125, which CTest takes
#   as skipped, where there is no xvfb-run.
set -eu
work="$1"
shift

if ! command -v xvfb-run >/dev/null; then
  echo "skipped: xvfb-run is missing"
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

cd "$work"
exec xvfb-run -a -s "-screen 0 1600x1000x24" "$@"
