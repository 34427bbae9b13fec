#!/usr/bin/env bash
# Opens the page of `srrf-eval tables` in a headless Chromium, sorts a table, turns a view, and takes
# screenshots; anything on the console or asked of the network is an error.
# usage: scripts/check-report.sh [REPORT.html [FOLDER]]   (default: a small report of built-in shapes; screenshots
# go to the folder, by default a temporary one)
# Needs node 18 or newer and Chromium: $CHROMIUM, or one on the path, or Debian's package, which is
# installed where apt-get may do so.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=${2:-$(mktemp -d)}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)

find_chromium() {
  for name in chromium chromium-browser google-chrome; do command -v "$name" && return; done
  return 1
}
chromium=${CHROMIUM:-$(find_chromium || true)}
if [ -z "$chromium" ]; then
  as_root=; [ "$(id -u)" = 0 ] || as_root=sudo
  $as_root apt-get update -qq && $as_root apt-get install -y -qq --no-install-recommends chromium >/dev/null
  chromium=$(find_chromium)
fi
command -v node >/dev/null || { echo "check-report: node 18 or newer is needed (https://nodejs.org)" >&2; exit 2; }

view=crates/srrf-view/web # has the browser's driver
[ -d "$view/node_modules/puppeteer-core" ] || (cd "$view" && npm ci --no-audit --no-fund)

report=${1:-}
if [ -z "$report" ]; then
  report=$folder/report/report.html
  SRRF_DATA='' cargo run --locked -q -p srrf-eval -- tables --shapes 2 --methods icp,oracle,srrf --parts main --out "$folder/report"
fi
node crates/srrf-eval/web/check.mjs "$chromium" "$(realpath "$report")" "$folder"
echo "screenshots are in $folder"
