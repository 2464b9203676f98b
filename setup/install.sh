#!/usr/bin/env bash
# Installs the Debian packages of packages.txt that are missing. Says what it will do; does nothing when nothing is missing.
# A line is `package`, or `package ?command`: not needed where the command is there already, and the set-up goes on without it.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)

missing=() optional=()
while read -r package unless; do
  if [ -n "$unless" ] && command -v "${unless#\?}" >/dev/null; then continue; fi
  status=$(dpkg-query -W -f='${Status}' "$package" 2>/dev/null || true)
  [ "$status" = "install ok installed" ] && continue
  if [ -n "$unless" ]; then optional+=("$package"); else missing+=("$package"); fi
done < <(sed -e 's/#.*//' -e 's/[[:space:]]*$//' -e '/^$/d' "$here/packages.txt")
if [ ${#missing[@]} -eq 0 ] && [ ${#optional[@]} -eq 0 ]; then
  exit 0
fi

without() {
  echo "set-up: goes on without ${optional[*]}: the report's 3-D views, plots and their tests need node, npm and a browser" >&2
  exit 0
}
as_root=()
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo >/dev/null; then
    [ ${#missing[@]} -gt 0 ] || without
    echo "set-up: error: these packages are missing and neither root nor sudo is at hand: ${missing[*]}" >&2
    exit 2
  fi
  as_root=(sudo)
fi

apt() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends \
    -o DPkg::Lock::Timeout=600 "$@"
}
echo "set-up: installing Debian packages: ${missing[*]} ${optional[*]}"
if ! "${as_root[@]}" apt-get update -q; then
  [ ${#missing[@]} -gt 0 ] || without
fi
if [ ${#missing[@]} -gt 0 ]; then apt "${missing[@]}"; fi
if [ ${#optional[@]} -gt 0 ]; then apt "${optional[@]}" || without; fi
