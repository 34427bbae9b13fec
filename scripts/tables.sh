#!/bin/sh
# The tables and curves of the book, from ModelNet40: scripts/tables.sh DATA [SWITCHES of srrf-eval tables]
# 100 test shapes, each at one severity; models trained clean come from the history of the repository.
# A run that was stopped goes on where it was: answers stay in report/cache.
set -eu
cd "$(dirname "$0")/.."
case ${1:-} in
    "" | -h | --help) sed -n '2,4s/^# //p' "$0"; [ -n "${1:-}" ] || exit 2; exit ;;
esac
data=$1
shift
folder=report/weights
clean=
for name in srrf dcp equi-gspr panet pointnetlk rgm; do
    file=$folder/$name-clean.safetensors
    [ -f "$file" ] || scripts/weights-from-history.sh "$name-clean" "$file"
    clean="$clean --clean-weights $name=$file"
done
# shellcheck disable=SC2086 # program and switches are words
exec ${SRRF_EVAL:-cargo run --locked -q -p srrf-eval --} tables --data "$data" --shapes 100 --spread $clean \
    --book book/src/generated "$@"
