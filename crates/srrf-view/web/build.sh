#!/usr/bin/env bash
# Rebuilds dist/srrf-view.js, byte for byte, from src/ and the versions in package-lock.json.
# `build.sh --check` leaves dist/ alone and fails if what it would write differs.
set -euo pipefail
cd "$(dirname "$0")"
[ -x node_modules/.bin/esbuild ] && [ -d node_modules/three ] || npm ci --no-audit --no-fund
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT

node_modules/.bin/esbuild src/main.js --bundle --minify --format=iife --target=es2022 --charset=utf8 \
  --loader:.css=text --legal-comments=inline --log-level=warning \
  --banner:js="/*! Contains three.js:
$(cat node_modules/three/LICENSE)
*/" --outfile="$out/srrf-view.js"
(cd "$out" && sha256sum srrf-view.js > SHA256SUMS)

if [ "${1:-}" = --check ]; then
  diff -q "$out/SHA256SUMS" dist/SHA256SUMS && cmp "$out/srrf-view.js" dist/srrf-view.js
else
  mkdir -p dist
  cp "$out/srrf-view.js" "$out/SHA256SUMS" dist/
  wc -c dist/srrf-view.js
fi
