#!/bin/sh
# clang-tidy over the sources that do not include CGAL, PCL or Bullet, whose headers would take most of the time.
set -eu
files=$(git ls-files '*.cpp' | grep -v '^tests/' | xargs grep -LE '#include [<"](CGAL|pcl|bt|Bullet|octomap)')
echo "$files" | xargs -P "$(nproc)" -n 4 clang-tidy -p build/release --quiet
