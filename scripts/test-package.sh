#!/usr/bin/env bash
# Installs the package in a Debian that was just made and has nothing else, and uses it: ParaView must load the
# plugin by itself, the programs must run; removed, it must leave nothing behind. Needs root and debootstrap.
set -euo pipefail

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
# shellcheck source=scripts/pristine-system.bash
source "$root/scripts/pristine-system.bash"
if [ $# -lt 1 ] || [ $# -gt 2 ] || [ ! -f "$1" ] || ! [[ ${2:-bookworm} =~ ^(bookworm|trixie|sid)$ ]]; then
  echo "Usage: scripts/test-package.sh PACKAGE.deb [bookworm|trixie|sid]" >&2
  exit 2
fi
require_debootstrap
package="$(realpath "$1")"
suite="${2:-bookworm}"
icons=qt6-svg-plugins
if [ "$suite" = bookworm ]; then
  icons=libqt5svg5
fi

mkdir -p "$root/build/logs"
pristine_system "$suite" "$root/build/logs/test-package-$suite.log"
cp "$package" "$system/root/package.deb"

cat >"$system/root/use.sh" <<'EOF'
set -eu
export DEBIAN_FRONTEND=noninteractive HOME=/root
apt-get -qq update
apt-get -qq -y --no-install-recommends install /root/package.deb python3-paraview "$1" xvfb xauth >/root/apt.log 2>&1 ||
  { tail -n 20 /root/apt.log; exit 1; }
echo "== Installed: $(dpkg-query -W -f '${Package} ${Version}' dynamiccoronary)"
cat /usr/bin/paraview.conf /usr/lib/*/paraview-*/paraview.conf 2>/dev/null || true
display() { xvfb-run -a -s "-screen 0 1280x900x24 -noreset" "$@"; }

cd /root
coronary-pipeline --version
coronary-pipeline phantom --seed 1 --phases 3 --spacing 0.8 --output phantom --quiet
coronary-pipeline run phantom/series.json --output run --quiet
coronary-pipeline evaluate --result run --truth phantom --no-pictures --output evaluation | tail -n 3
coronary-simulator --headless --scenario phantom-lca --output session --ticks 400 >/dev/null
coronary-posing run --headless --pose-move 4:2,0,0 --pose-output pose.vtp --quiet
coronary-device-emulator --help >/dev/null

cat >autoload.py <<'PYTHON'
from paraview import simple
if not hasattr(simple, "CoronaryPhantom"):
    raise SystemExit("ParaView's Python did not load the plugin by itself")
tree = simple.Calculator(Input=simple.OutputPort(simple.CoronaryPhantom(), 1))
tree.UpdatePipeline(0.35)
print("pvpython: %d points of the centerlines" % tree.GetDataInformation().GetNumberOfPoints())
PYTHON
pvpython autoload.py
cat >window.py <<'PYTHON'
from paraview import simple
open("/root/window.txt", "w").write("loaded" if hasattr(simple, "CoronaryPhantom") else "not loaded")
PYTHON
display timeout 120 paraview --script=/root/window.py >/root/paraview.log 2>&1 &
window=$!
for _ in $(seq 100); do [ -e /root/window.txt ] && break; sleep 1; done
kill "$window" 2>/dev/null || true
echo "paraview: plugin $(cat /root/window.txt)"
[ "$(cat /root/window.txt)" = loaded ]

apt-get -qq -y remove dynamiccoronary >/root/apt.log 2>&1 || { tail -n 20 /root/apt.log; exit 1; }
if [ -e /usr/bin/paraview.conf ] || grep -i coronary /usr/lib/*/paraview-*/paraview.conf 2>/dev/null || find / -xdev -path /proc -prune -o -iname '*coronary*' -not -path '/root/*' -not -path '/var/*' -print | grep .; then
  echo "test-package: the files above stayed behind" >&2
  exit 1
fi
echo "== Removed without a trace"
EOF
in_system "bash /root/use.sh $icons"
