#!/usr/bin/env bash
# Checks glTF files with the Khronos validator, and prints what it finds.
#
# Its npm package is fetched once from registry.npmjs.org into ~/.cache/dynamiccoronary, and taken only with the
# SHA-512 below. It runs with Debian's nodejs; npm is not needed.
set -euo pipefail

version=2.0.0-dev.3.10
sha512=a1d278934b519065e20c69fbf320c183e7c16c022f0675f187747002d6b47a64b11adc9a80513c078c442c1d6861edd2e510fc0a2dee640b1969ab1c1f62c011

usage() {
  cat <<'EOF'
Usage: scripts/gltf-validator.sh FILE.glb ..
Exit code: 0 no errors and no warnings, 1 there are some, 2 command line,
125 the validator can not be had: no node, no curl, no network.
EOF
}

if [ $# -eq 0 ] || [ "$1" = --help ]; then
  usage
  [ $# -gt 0 ] && exit 0 || exit 2
fi
for tool in node curl; do
  if ! command -v "$tool" >/dev/null; then
    echo "gltf-validator: '$tool' is missing; run scripts/install-dependencies.sh" >&2
    exit 125
  fi
done

cache="${XDG_CACHE_HOME:-${HOME:-$(cd ~ && pwd)}/.cache}/dynamiccoronary"
folder="$cache/gltf-validator-$version"
if [ ! -f "$folder/package/index.js" ]; then
  mkdir -p "$cache"
  work="$(mktemp -d "$cache/gltf-validator.XXXXXX")"
  trap 'rm -rf "$work"' EXIT
  if ! curl -fsSL --retry 2 --max-time 60 -o "$work/package.tgz" \
    "https://registry.npmjs.org/gltf-validator/-/gltf-validator-$version.tgz"; then
    echo "gltf-validator: registry.npmjs.org does not give the package" >&2
    exit 125
  fi
  if ! echo "$sha512  $work/package.tgz" | sha512sum --check --status; then
    echo "gltf-validator: the package of registry.npmjs.org is not the one that was checked" >&2
    exit 1
  fi
  mkdir "$work/content"
  tar -xzf "$work/package.tgz" -C "$work/content"
  chmod 755 "$work/content"
  # Whole or not at all; another process may have been faster.
  mv -T "$work/content" "$folder" 2>/dev/null || [ -f "$folder/package/index.js" ]
fi

VALIDATOR="$folder/package/index.js" node - "$@" <<'EOF'
const fs = require("fs");
const path = require("path");
const validator = require(process.env.VALIDATOR);

async function check(file) {
  const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {
    uri: path.basename(file),
    maxIssues: 0,
    externalResourceFunction: (uri) =>
      fs.promises.readFile(path.join(path.dirname(file), decodeURIComponent(uri))).then((data) => new Uint8Array(data)),
  });
  const { numErrors, numWarnings, numInfos, numHints, messages } = report.issues;
  console.log(`${file}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos, ${numHints} hints`);
  for (const message of messages.slice(0, 20)) {
    console.log(`  ${message.code} ${message.pointer || ""}: ${message.message}`);
  }
  return numErrors + numWarnings === 0;
}

(async () => {
  let good = true;
  for (const file of process.argv.slice(2)) {
    good = (await check(file)) && good;
  }
  process.exit(good ? 0 : 1);
})().catch((error) => {
  console.error(`gltf-validator: ${error.message || error}`);
  process.exit(1);
});
EOF
