#!/usr/bin/env bash
# Opens the pages that the programs write in a headless Chromium, uses every control and takes screenshots; anything on
# the console or asked of the network is an error.
#
#   scripts/check-pages.sh [--report REPORT.html] [FOLDER]
#
# Pages and screenshots go to FOLDER (default: a temporary one). Without --report, a small one of built-in shapes is
# made; with it, that one alone is looked at. Needs node 18 or newer and Chromium: $CHROMIUM, or one on the path, or
# Debian's package, which is installed where apt-get may do so. Takes about 3 minutes on 2 cores.
set -euo pipefail
cd "$(dirname "$0")/.."
report=
if [ "${1:-}" = --report ]; then
  report=$(realpath "$2")
  shift 2
fi
folder=${1:-$(mktemp -d)}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)

find_chromium() {
  for name in chromium chromium-browser google-chrome; do command -v "$name" && return; done
  return 1
}
command -v node >/dev/null || { echo "check-pages: node 18 or newer is needed (https://nodejs.org)" >&2; exit 2; }
chromium=${CHROMIUM:-$(find_chromium || true)}
if [ -z "$chromium" ]; then
  as_root=; [ "$(id -u)" = 0 ] || as_root=sudo
  $as_root apt-get update -qq && $as_root apt-get install -y -qq --no-install-recommends chromium >/dev/null
  chromium=$(find_chromium)
fi

web=crates/srrf-view/web
[ -d "$web/node_modules/puppeteer-core" ] || (cd "$web" && npm ci --no-audit --no-fund)

if [ -z "$report" ]; then
  "$web/build.sh" --check
  page() { cargo run --locked -q -p srrf-view --example page -- "$@"; }
  page "$folder/one.html"
  page "$folder/gallery.html" --points 1024 --pairs 4
  page "$folder/large.html" --points 2000000
  page "$folder/far.html" --points 5000 --offset 500000,5400000,120
  node "$web/check/check.mjs" "$chromium" "$folder"
  report=$folder/report/report.html
  SRRF_DATA='' cargo run --locked -q -p srrf-eval -- tables --shapes 2 --methods icp,oracle,srrf --parts main \
    --out "$folder/report"
fi
node crates/srrf-eval/web/check.mjs "$chromium" "$report" "$folder"
echo "screenshots are in $folder"
