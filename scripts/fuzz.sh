#!/usr/bin/env bash
# Fuzzes what reads bytes of others with libFuzzer, each reader for a while; ends with a table.
set -euo pipefail

usage() {
  cat <<'EOF'
Usage: scripts/fuzz.sh [--seconds N] [--harness NAME]... [-j N] [--program FILE] [--list]
  --seconds N     for each harness (default: 600)
  --harness NAME  this one only; may be given again (default: all)
  -j N            jobs of the build, and harnesses at a time (default: 1)
  --program FILE  a coronary-fuzz that is built already
  --list          names of the harnesses
Builds the preset 'fuzz' (clang, libFuzzer) in build/fuzz. What is found stays in build/fuzz/findings/NAME, the corpus in
build/fuzz/corpus/NAME. Exit code 1 when there are findings.
EOF
}

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
seconds=600
jobs=1
program=""
list=no
harnesses=()
while [ $# -gt 0 ]; do
  case "$1" in
    --seconds | --harness | --program | -j)
      if [ $# -lt 2 ]; then
        echo "fuzz: $1 takes a value" >&2
        exit 2
      fi
      case "$1" in
        --seconds) seconds="$2" ;;
        --harness) harnesses+=("$2") ;;
        --program) program="$2" ;;
        -j) jobs="$2" ;;
      esac
      shift
      ;;
    --list) list=yes ;;
    -h | --help)
      usage
      exit 0
      ;;
    *)
      echo "fuzz: unknown option '$1'" >&2
      usage >&2
      exit 2
      ;;
  esac
  shift
done
for number in "$seconds" "$jobs"; do
  if ! [[ $number =~ ^[1-9][0-9]*$ ]]; then
    echo "fuzz: '$number' is no number above 0" >&2
    exit 2
  fi
done

cd "$root"
if [ -z "$program" ]; then
  cmake --preset fuzz >/dev/null
  cmake --build --preset fuzz -j "$jobs" --target coronary-fuzz
  program="$root/build/fuzz/bin/coronary-fuzz"
fi
# Also when libFuzzer's own options are set for everything.
export ASAN_OPTIONS="allocator_may_return_null=1:detect_stack_use_after_return=1:${ASAN_OPTIONS:-}"
export UBSAN_OPTIONS="print_stacktrace=1:${UBSAN_OPTIONS:-}"
export LSAN_OPTIONS="suppressions=$root/Testing/lsan.supp:print_suppressions=0"
if [ "$list" = yes ]; then
  exec "$program" --list
fi
if [ ${#harnesses[@]} -eq 0 ]; then
  mapfile -t harnesses < <("$program" --list)
fi
if [ ${#harnesses[@]} -eq 0 ]; then
  echo "fuzz: '$program' does not run" >&2
  exit 1
fi

work="$root/build/fuzz"
scratch="$(mktemp -d "$([ -d /dev/shm ] && echo /dev/shm || echo /tmp)/coronary-fuzz.XXXXXX")"
trap 'rm -rf "$scratch"' EXIT

# fuzz NAME: leaves build/fuzz/logs/NAME.log
fuzz() {
  local name="$1"
  local corpus="$work/corpus/$name"
  local findings="$work/findings/$name"
  mkdir -p "$corpus" "$findings" "$work/logs" "$scratch/$name"
  : >"$work/logs/$name.log"
  if ! "$program" "--seeds=$name" "$corpus"; then
    return
  fi
  TMPDIR="$scratch/$name" "$program" "--harness=$name" -max_total_time="$seconds" \
    -rss_limit_mb=2048 -malloc_limit_mb=512 -timeout=20 -max_len=65536 -print_final_stats=1 \
    -artifact_prefix="$findings/" "$corpus" >"$work/logs/$name.log" 2>&1 || true
}

for name in "${harnesses[@]}"; do
  while [ "$(jobs -rp | wc -l)" -ge "$jobs" ]; do
    wait -n
  done
  echo "== $name, $seconds s"
  fuzz "$name" &
done
wait

printf '\n%-22s %12s %9s %8s %8s\n' harness executions coverage seconds findings
found=0
for name in "${harnesses[@]}"; do
  log="$work/logs/$name.log"
  executions="$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")"
  coverage="$(sed -n 's/.* cov: \([0-9]*\) .*/\1/p' "$log" | tail -n 1)"
  took="$(sed -n 's/^Done [0-9]* runs in \([0-9]*\) .*/\1/p' "$log")"
  count="$(find "$work/findings/$name" -type f | wc -l)"
  if [ -z "$took" ] && [ "$count" -eq 0 ]; then
    count=1 # it ended early, and left nothing
  fi
  found=$((found + count))
  printf '%-22s %12s %9s %8s %8s\n' "$name" "${executions:--}" "${coverage:--}" "${took:--}" "$count"
done
if [ "$found" -gt 0 ]; then
  echo "FAILED: $found findings; see build/fuzz/findings and build/fuzz/logs"
  exit 1
fi
