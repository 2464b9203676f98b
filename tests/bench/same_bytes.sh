#!/bin/sh
# Two stores of one flow hold the same: every record the same content and metrics, every artefact the same files and bytes.
#   sh tests/bench/same_bytes.sh STORE STORE
set -eu
list() {
  (
    cd "$1"
    find artefacts -type f -exec sha256sum {} + | sort -k 2
    find records -type f | sort | while read -r record; do
      echo "$record $(sed '/^$/,$d' "$record" | grep -E '^(content|metric) ' | sha256sum)"
    done
  )
}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
list "$1" > "$work/first"
list "$2" > "$work/second"
if ! diff "$work/first" "$work/second"; then
  echo "the stores differ"
  exit 1
fi
echo "the same: $(find "$1/records" -type f | wc -l) records, $(find "$1/artefacts" -type f | wc -l) files, $(du -sm "$1/artefacts" | cut -f 1) MB"
