# shellcheck shell=bash
# Sourced by the scripts that try the project on a system that has nothing yet. Needs root and debootstrap.

# What of the tools is missing, named as the script that asks.
require_debootstrap() {
  if [ "$(id -u)" -ne 0 ]; then
    echo "$(basename "$0" .sh): run me as root: a system of its own is entered by chroot" >&2
    exit 1
  fi
  if ! command -v debootstrap >/dev/null; then
    echo "$(basename "$0" .sh): debootstrap is missing (apt-get install debootstrap)" >&2
    exit 1
  fi
}

# pristine_system SUITE LOG
#   Makes a system of a suite of Debian or Ubuntu; its folder is then `system`. Its base is made once and kept in `systems`, a
#   folder of the user's cache; what is put on top of it goes with the script, unless that has another trap for its end.
pristine_system() {
  local suite="$1" log="$2" mirror="http://deb.debian.org/debian"
  local options=("--variant=minbase" "--include=git,ca-certificates")
  if [ "$suite" = noble ]; then
    mirror="http://archive.ubuntu.com/ubuntu"
    options+=("--components=main,universe")
    # Debian has no key of Ubuntu's archive unless ubuntu-keyring is installed.
    [ -f /usr/share/keyrings/ubuntu-archive-keyring.gpg ] || options+=(--no-check-gpg)
  fi
  made="" system=""
  trap 'rm -rf "$made" "$system"' EXIT
  systems="${XDG_CACHE_HOME:-${HOME:-/root}/.cache}/dynamiccoronary/systems"
  mkdir -p "$systems"
  if [ ! -d "$systems/$suite" ]; then
    echo "== A base system of $suite, once (log: $log)"
    made="$(mktemp -d "$systems/$suite.XXXXXX")"
    if ! debootstrap "${options[@]}" "$suite" "$made/root" "${DYNAMICCORONARY_MIRROR:-$mirror}" >>"$log" 2>&1; then
      tail -n 20 "$log" >&2
      echo "$(basename "$0" .sh): debootstrap could not make a system of $suite" >&2
      exit 1
    fi
    mv -T "$made/root" "$systems/$suite"
    rmdir "$made"
  fi
  system="$(mktemp -d "$systems/$suite-run.XXXXXX")"
  cp -a "$systems/$suite/." "$system"
  cp -L /etc/resolv.conf "$system/etc/resolv.conf"
  # It need not outlive a loss of power, and half of the time that packages take is waiting for the disk.
  mkdir -p "$system/etc/dpkg/dpkg.cfg.d"
  echo force-unsafe-io >"$system/etc/dpkg/dpkg.cfg.d/no-sync"
}

# in_system COMMAND [FOLDER=PLACE]...
#   The shell's command in `system`, with folders of this one at places in it. The mounts are in a name space of their own: they
#   are gone with its last process, whatever happens.
in_system() {
  # shellcheck disable=SC2016 # for the shell inside
  unshare --mount --pid --fork --kill-child sh -euc '
    system=$1 command=$2
    shift 2
    mount -t proc proc "$system/proc"
    mount --rbind /dev "$system/dev"
    mount --rbind /sys "$system/sys"
    for pair; do
      mkdir -p "$system${pair#*=}"
      mount --bind "${pair%%=*}" "$system${pair#*=}"
    done
    exec chroot "$system" env -i HOME=/root PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 \
      sh -c "$command"
  ' in-system "$system" "$@" </dev/null
}
