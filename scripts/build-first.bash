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

# Says every half minute how far the build is that writes a log, as long as this script runs.
report_progress() {
  local log="$1" begun="$SECONDS" passed
  while sleep 30 >/dev/null && kill -0 "$$" 2>/dev/null; do
    passed=$((SECONDS - begun))
    printf '   %d:%02d min  %s\n' $((passed / 60)) $((passed % 60)) \
      "$(grep -aoE '^\[[0-9]+/[0-9]+\] [^/]*' "$log" 2>/dev/null | tail -n 1 || true)"
  done
}

# Builds without the tests, for ParaView. LOG [option of cmake --build]...
build_product() {
  local log="$1"
  shift
  echo "== Building (log: $log)"
  mkdir -p "$(dirname "$log")"
  # A tree that has tests keeps them: its developer wants them.
  local tests=OFF
  if grep -qs '^BUILD_TESTING:[A-Z]*=ON' build/paraview/CMakeCache.txt; then
    tests=ON
  fi
  report_progress "$log" &
  local reporter=$! built=yes
  { cmake --preset paraview -D "BUILD_TESTING=$tests" && cmake --build --preset paraview -j "$jobs" "$@"; } >"$log" 2>&1 || built=no
  kill "$reporter" 2>/dev/null || true
  if [ "$built" = no ]; then
    tail -n 40 "$log" >&2
    exit 1
  fi
}

# Installs what is missing and builds what is installed. LOG [option of cmake --build]...
install_and_build() {
  if [ "$install" = yes ]; then
    echo "== Packages"
    scripts/install-dependencies.sh --tree paraview --no-tests
  fi
  build_product "$@"
}
