#!/bin/sh
# Writes weights that left the tree, and their card, from the history of the repository to where they lay:
#   scripts/weights-from-history.sh srrf-small-2 [FILE]
# `clean` stands for all models trained without corruption. weights/LINEAGE.toml names what there is.
set -eu
cd "$(dirname "$0")/.."
lineage=weights/LINEAGE.toml

# entry NAME KEY: the value of a key, of the entry of that name.
entry() {
    awk -v name="name = \"$1\"" -v key="$2" '
        /^\[\[weights\]\]/ { here = 0 }
        $0 == name { here = 1 }
        here && $1 == key { gsub(/"/, "", $3); print $3 }' "$lineage"
}

fetch() {
    name=$1
    file=$(entry "$name" file)
    if [ -z "$file" ]; then
        echo "$name: $lineage names no such weights; it names:" >&2
        sed -n 's/^name = "\(.*\)"$/  \1/p' "$lineage" >&2
        exit 2
    fi
    commit=$(entry "$name" commit)
    out=${2:-$file}
    if ! git cat-file -e "$commit:$file" 2>/dev/null; then
        echo "$name: commit $commit is not in this clone; run \`git fetch --unshallow\` first" >&2
        exit 1
    fi
    mkdir -p "$(dirname "$out")"
    git show "$commit:$file" >"$out.partial"
    sum=$(sha256sum "$out.partial" | cut -d' ' -f1)
    if [ "$sum" != "$(entry "$name" sha256)" ]; then
        rm "$out.partial"
        echo "$name: the SHA-256 is $sum, not the one of $lineage" >&2
        exit 1
    fi
    mv "$out.partial" "$out"
    echo "wrote $out"
    card=${file%.safetensors}.md
    if [ "$out" = "$file" ] && git cat-file -e "$commit:$card" 2>/dev/null; then
        git show "$commit:$card" >"$card"
        echo "wrote $card"
    fi
}

case ${1:-} in
    "" | -h | --help) sed -n '2,4s/^# //p' "$0"; [ -n "${1:-}" ] || exit 2 ;;
    clean) sed -n 's/^name = "\(.*-clean\)"$/\1/p' "$lineage" | while read -r name; do fetch "$name"; done ;;
    *) fetch "$@" ;;
esac
