#!/bin/sh
# A data set with one broken object in ten: the others must be done, the exit code must be 1, each broken one must stand in
# the ledger with a sentence, and the ledger's command must repeat it.
#   sh tests/bench/broken_set.sh PROGRAM FOLDER [N]        N objects (20), made in FOLDER
set -eu
program=$(realpath "$1")
mkdir -p "$2"
cd "$2"
count=${3:-20}
broken=$(((count + 9) / 10))
"$program" datasets get shapes --json > shapes.json
rm -rf set store out
mkdir set

# Healthy ones: the shapes of the catalogue in turn.
grep '"file"' shapes.json | sed 's/.*: "\(.*\)".*/\1/' > files
i=0
while [ $i -lt $((count - broken)) ]; do
  file=$(sed -n "$((i % $(wc -l < files) + 1))p" files)
  cp "$file" "set/$(printf %03d $i)_$(basename "$file")"
  i=$((i + 1))
done

# Broken ones, of five kinds in turn.
i=0
while [ $i -lt $broken ]; do
  to=set/broken_$(printf %02d $i)
  head="ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
  case $((i % 5)) in
    0) head -c 3000 "$(sed -n 1p files)" > "$to.ply" ;;                                                  # cut off
    1) printf "${head}0 0 0\n.1 0 0\n0 .1 0\n0 0 nan\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n" > "$to.ply" ;;  # a vertex that is no number
    2) printf "${head}0 0 0\n.1 0 0\n0 .1 0\n0 0 .1\n3 0 2 1\n3 0 1 9\n3 0 3 2\n3 1 2 3\n" > "$to.ply" ;;   # a vertex that isn't there
    3) : > "$to.stl" ;;                                                                                # nothing
    4) printf 'o thing\nv 0 0 0\nv 90 0 0\nv 0 90 0\nv 0 0 90\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n' > "$to.obj" ;; # millimetres
  esac
  i=$((i + 1))
done

cat > flow.toml <<END
hands = ["schunk_sdh"]
[scan]
views = 4
width = 160
height = 120
[remesh]
edge_length_m = 0.008
[field]
cells = 32
[score]
max_candidates = 4
min_candidates = 1
[place]
max_grasps = 1
[evaluate]
control_grasps = 1
self_check_trials = 0
lift_grasps = 0
[cage]
control_grasps = 1
self_check_trials = 0
margin_grasps = 0
wrench_amplitudes = [1.0]
search_samples = 300
END
code=0
"$program" run flow.toml --dataset set --store store --out out --jobs 2 --pictures 0 --json > run.json 2> run.log || code=$?
counts=$(tr -d ' \n' < run.json | sed 's/.*"counts":{\([^}]*\)}.*/\1/')
echo "exit code $code, counts $counts"
[ $code = 1 ] || { echo "the exit code is not 1"; exit 1; }

"$program" failures --store store > failures
for file in set/broken_*; do
  name=$(basename "$file" | sed 's/\..*//')
  grep -q "^$name/" failures || { echo "$name is not in the ledger"; exit 1; }
done
grep -v '^  ' failures
grep '^  geocage ' failures | while read -r command; do
  again=0
  sh -c "'$program' ${command#geocage } --quiet" > again.log 2>&1 || again=$?
  [ $again = 1 ] || { echo "does not repeat ($again): $command"; exit 1; }
done
"$program" query "select count(distinct object) as objects, count(distinct case when pair_outcome = 'failed' then object end) as failed from grasps" --out out
echo "every command of the ledger repeats its failure"
