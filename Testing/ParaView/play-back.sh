#!/bin/sh
# play-back.sh <play-back.xml> <folder> <command ...>
#   Runs ParaView's window, which plays the file back, and fails unless every check('...') in it was right: the
#   window's Python shell prints an exception, also of a script that does not load, and goes on.
set -eu
checks="$(sed -n "s/.*arguments=\"check('\([^']*\)').*/\1/p" "$1")"
folder="$2"
shift 2
rm -f "$folder/checked"
"$@"
if [ -z "$checks" ] || [ "$checks" != "$(cat "$folder/checked")" ]; then
  echo "FAILED: not every check of the play-back was made"
  exit 1
fi
