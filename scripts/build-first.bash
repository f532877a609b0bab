# shellcheck shell=bash
# Sourced by the scripts that install and build before they do anything: options and steps that they share.
# Who sources it has a function `usage`.
install=yes
jobs="$(nproc)"

# The first of the arguments, if it is one of those options: `taken` becomes how many arguments it has.
# shellcheck disable=SC2034  # taken: they shift by it
build_option() {
  taken=1
  case "$1" in
    --no-install) install=no ;;
    -j | -j*)
      jobs="${1#-j}"
      if [ "$1" = -j ]; then
        jobs="${2:-}"
        taken=2
      fi
      if ! [[ $jobs =~ ^[1-9][0-9]*$ ]]; then
        echo "$(basename "$0" .sh): -j takes a number of jobs, not '$jobs'" >&2
        exit 2
      fi
      ;;
    -h | --help)
      usage
      exit 0
      ;;
    *) return 1 ;;
  esac
}

refuse_option() {
  echo "$(basename "$0" .sh): unknown option '$1'" >&2
  usage >&2
  exit 2
}

# Installs what is missing and builds for ParaView. LOG [option of cmake --build]...
install_and_build() {
  local log="$1"
  shift
  if [ "$install" = yes ]; then
    echo "== Packages"
    scripts/install-dependencies.sh --tree paraview --no-tests
  fi
  echo "== Building (log: $log)"
  mkdir -p "$(dirname "$log")"
  if ! { cmake --preset paraview && cmake --build --preset paraview -j "$jobs" "$@"; } >"$log" 2>&1; then
    tail -n 40 "$log" >&2
    exit 1
  fi
}
