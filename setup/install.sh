#!/usr/bin/env bash
# Installs the Debian packages of packages.txt that are missing. Says what it will do; does nothing when nothing is missing.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)

# A line is `package`, or `package ?command`: not needed where the command is there already.
missing=()
while read -r package unless; do
  if [ -n "$unless" ] && command -v "${unless#\?}" >/dev/null; then continue; fi
  status=$(dpkg-query -W -f='${Status}' "$package" 2>/dev/null || true)
  [ "$status" = "install ok installed" ] || missing+=("$package")
done < <(sed -e 's/#.*//' -e 's/[[:space:]]*$//' -e '/^$/d' "$here/packages.txt")
if [ ${#missing[@]} -eq 0 ]; then
  exit 0
fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo >/dev/null; then
    echo "set-up: error: these packages are missing and neither root nor sudo is at hand: ${missing[*]}" >&2
    exit 2
  fi
  as_root=(sudo)
fi

echo "set-up: installing ${#missing[@]} Debian packages: ${missing[*]}"
"${as_root[@]}" apt-get update -q
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends \
  -o DPkg::Lock::Timeout=600 "${missing[@]}"
