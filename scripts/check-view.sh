#!/usr/bin/env bash
# Opens generated pages of srrf-view in a headless Chromium, uses every control and takes screenshots.
# usage: scripts/check-view.sh [FOLDER]   (pages and screenshots go there; default: a temporary one)
# Needs node 18 or newer and Chromium: $CHROMIUM, or one on the path, or Debian's package, which is
# installed where apt-get may do so. Takes about 2 minutes on 2 cores once srrf-view is built.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=${1:-$(mktemp -d)}
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
command -v node >/dev/null || { echo "check-view: node 18 or newer is needed (https://nodejs.org)" >&2; exit 2; }

web=crates/srrf-view/web
[ -d "$web/node_modules/puppeteer-core" ] || (cd "$web" && npm ci --no-audit --no-fund)
"$web/build.sh" --check

page() { cargo run --locked -q -p srrf-view --example page -- "$@"; }
page "$folder/one.html"
page "$folder/gallery.html" --points 1024 --pairs 4
page "$folder/large.html" --points 2000000
page "$folder/far.html" --points 5000 --offset 500000,5400000,120
node "$web/check/check.mjs" "$chromium" "$folder"
echo "screenshots are in $folder"
