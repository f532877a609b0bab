#!/usr/bin/env bash
# Installs the package in a Debian that was just made and has nothing else, and uses it: ParaView must load the
# plugin by itself, the programs must run; removed, it must leave nothing behind. Needs root and debootstrap.
set -euo pipefail

if [ $# -lt 1 ] || [ $# -gt 3 ] || [ ! -f "$1" ] || ! [[ ${2:-bookworm} =~ ^(bookworm|trixie|sid)$ ]]; then
  echo "Usage: scripts/test-package.sh PACKAGE.deb [bookworm|trixie|sid [FOLDER]]   (FOLDER, where the system is made: default mktemp -d)" >&2
  exit 2
fi
if [ "$(id -u)" -ne 0 ] || ! command -v debootstrap >/dev/null; then
  echo "test-package: run me as root, with debootstrap installed" >&2
  exit 1
fi
package="$(realpath "$1")"
suite="${2:-bookworm}"
system="$(realpath "${3:-$(mktemp -d)}")"
mirror="${DYNAMICCORONARY_MIRROR:-http://deb.debian.org/debian}"
icons=qt6-svg-plugins
if [ "$suite" = bookworm ]; then
  icons=libqt5svg5
fi

# Its mounts are seen by this process and its children only.
if [ -z "${DYNAMICCORONARY_OWN_MOUNTS:-}" ]; then
  DYNAMICCORONARY_OWN_MOUNTS=yes exec unshare --mount -- "$0" "$package" "$suite" "$system"
fi
if [ ! -e "$system/usr/bin/dpkg" ]; then
  echo "== A new $suite in $system"
  debootstrap --variant=minbase --include=ca-certificates "$suite" "$system" "$mirror" >"$system.log" 2>&1
fi
cp /etc/resolv.conf "$system/etc/resolv.conf"
cp "$package" "$system/root/package.deb"
mount -t proc proc "$system/proc"
mount --rbind /dev "$system/dev"

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
chroot "$system" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 bash /root/use.sh "$icons"
