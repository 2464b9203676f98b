#!/bin/sh
# viewer.sh SOURCES OUT STAMP: bundles the report's pages into OUT and touches STAMP. Never fails for want of node, npm or the
# network: it then says what is missing, leaves no STAMP, and the next build tries again. A mistake in the sources does fail.
set -u
sources=$1 out=$2 stamp=$3
missing() {
  echo "geocage: the report's 3-D views, interactive plots and filtered tables are not built: $1"
  echo "geocage: reports will have the plain page: pictures, tables and intervals"
  rm -f "$out"/*.js "$out"/*.css
  exit 0
}
command -v node >/dev/null || missing "node is not here"
mkdir -p "$out"
wanted=$(cat "$sources/package.json" "$sources/package-lock.json" | cksum)
if [ "$wanted" != "$(cat "$sources/node_modules/.geocage" 2>/dev/null)" ]; then
  command -v npm >/dev/null || missing "npm is not here"
  log=$out/npm.log
  (cd "$sources" && npm ci --no-audit --no-fund --ignore-scripts --fetch-retries=1 --fetch-timeout=60000) >"$log" 2>&1 ||
    missing "npm could not bring the packages (no network? see $log)"
  echo "$wanted" >"$sources/node_modules/.geocage"
fi
node "$sources/build.mjs" "$out" || exit 1
touch "$stamp"
