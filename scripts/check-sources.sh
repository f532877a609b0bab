#!/usr/bin/env bash
# Checks that need no build: layers, sizes, formatting, XML, scripts, reference pages, links. Exit 1 when one of them fails.
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
failures=0

fail() {
  echo "FAILED: $1"
  failures=$((failures + 1))
}

# What git tracks; a source archive has no git.
list_files() {
  if git rev-parse --is-inside-work-tree >/dev/null 2>&1; then
    git ls-files | while IFS= read -r file; do
      if [ -f "$file" ]; then
        echo "$file"
      fi
    done
  else
    find . -type f -not -path './.git/*' -not -path './build/*' -not -path './demo-output/*' \
      -not -path './validation-output/*' \
      | sed 's#^\./##'
  fi
}
mapfile -t files < <(list_files | LC_ALL=C sort -u)

sources=()
algorithms=()
xmls=()
scripts=()
for file in "${files[@]}"; do
  case "$file" in
    *.h | *.hpp | *.cxx | *.cpp | *.c)
      sources+=("$file")
      case "$file" in
        Filters/* | Formats/* | Simulator/*)
          if [[ "$(basename "$file")" != *vtk* ]]; then
            algorithms+=("$file")
          fi
          ;;
      esac
      ;;
    ServerManagerXML/*.xml | Plugin/*.xml) xmls+=("$file") ;;
    *.sh | *.bash | .ci/run) scripts+=("$file") ;;
  esac
done

# The algorithms are used without VTK: by the simulator's real-time loop and by other programs.
if [ ${#algorithms[@]} -gt 0 ] \
  && grep -nE '^[[:space:]]*#[[:space:]]*include[[:space:]]*[<"]([^>"]*/)?vtk' "${algorithms[@]}" /dev/null; then
  fail "a file without 'vtk' in its name includes a VTK header"
else
  echo "ok: ${#algorithms[@]} algorithm files include no VTK header"
fi

# Other versions format differently; 14 is Debian 12's.
clang_format=""
for candidate in clang-format-14 clang-format; do
  if command -v "$candidate" >/dev/null && [[ "$("$candidate" --version)" == *"version 14."* ]]; then
    clang_format="$candidate"
    break
  fi
done
if [ -z "$clang_format" ]; then
  echo "skipped: formatting (clang-format 14 is not installed)"
else
  # Many files a process: most of the time is for starting it.
  works=yes
  said="$(printf '%s\0' "${sources[@]}" | xargs -0 -n 50 -P "$(nproc)" "$clang_format" --dry-run -Werror 2>&1)" || works=no
  mapfile -t unformatted < <(sed -n 's/^\([^:]*\):[0-9]*:[0-9]*: error: code should be clang-formatted.*/\1/p' <<<"$said" \
    | LC_ALL=C sort -u)
  if [ ${#unformatted[@]} -gt 0 ]; then
    fail "formatting; mend it with: $clang_format -i ${unformatted[*]}"
  elif [ "$works" = no ]; then
    fail "$clang_format: $said"
  else
    echo "ok: ${#sources[@]} C++ files are formatted"
  fi
fi

python3=""
if command -v python3 >/dev/null; then
  python3=python3
fi
malformed=0
for xml in "${xmls[@]}"; do
  if command -v xmllint >/dev/null; then
    xmllint --noout --nonet "$xml" || malformed=1
  elif [ -n "$python3" ]; then
    "$python3" -c 'import sys, xml.dom.minidom
try:
    xml.dom.minidom.parse(sys.argv[1])
except Exception as error:
    sys.exit("%s: %s" % (sys.argv[1], error))' "$xml" || malformed=1
  fi
done
if [ "$malformed" -ne 0 ]; then
  fail "XML that is not well-formed"
elif ! command -v xmllint >/dev/null && [ -z "$python3" ]; then
  echo "skipped: XML (neither xmllint nor python3 is installed)"
else
  echo "ok: ${#xmls[@]} XML files are well-formed"
fi

bad_scripts=0
for script in "${scripts[@]}"; do
  if [[ $script != *.bash && ! -x $script ]]; then
    echo "$script is not executable"
    bad_scripts=1
  fi
  bash -n "$script" || bad_scripts=1
done
if [ ${#scripts[@]} -gt 0 ] && command -v shellcheck >/dev/null; then
  shellcheck "${scripts[@]}" || bad_scripts=1
fi
if [ "$bad_scripts" -ne 0 ]; then
  fail "scripts"
else
  echo "ok: ${#scripts[@]} shell scripts"
fi

if [ -z "$python3" ]; then
  echo "skipped: layers, sizes, reference pages and links (python3 is not installed)"
else
  "$python3" scripts/check-layers.py || fail "a header of a layer above is included"
  if "$python3" scripts/check-sizes.py; then
    echo "ok: no file above 1,200 lines, no function above 150"
  else
    fail "files or functions that are too long"
  fi
  "$python3" scripts/make-filter-reference.py --check || fail "reference of the filters"
  "$python3" scripts/check-links.py || fail "links of the documentation"
fi

if [ "$failures" -gt 0 ]; then
  echo "$failures check(s) failed"
  exit 1
fi
