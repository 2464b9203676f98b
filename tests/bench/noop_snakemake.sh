#!/bin/sh
# The peer of noop_study: Debian's snakemake (apt-get install snakemake) with as many files, all of them there.
#   sh tests/bench/noop_snakemake.sh FOLDER [ITEMS [NOOP_STUDY]]
set -eu
items=${2:-1000}
here=$PWD
mkdir -p "$1"
cd "$1"
cat > Snakefile <<END
ITEMS = range($items)
rule all:
    input: expand("out/{i}.7", i=ITEMS)
rule first:
    output: "out/{i}.0"
    shell: "echo {wildcards.i} > {output}"
END
for k in 1 2 3 4 5 6 7; do
  printf 'rule step%s:\n    input: "out/{i}.%s"\n    output: "out/{i}.%s"\n    shell: "cp {input} {output}"\n' \
    $k $((k - 1)) $k >> Snakefile
done
# Made by hand, in order, so that only the second kind of run is measured.
mkdir -p out
for k in 0 1 2 3 4 5 6 7; do
  for i in $(seq 0 $((items - 1))); do echo "$i" > "out/$i.$k"; done
done
/usr/bin/time -f "snakemake: %e s passed, %U + %S s of processor, %M kB" snakemake --cores 1 --quiet
# Both in one run: sh tests/bench/noop_snakemake.sh FOLDER 1000 build/bench/noop_study
if [ -n "${3:-}" ]; then
  cd "$here"
  "$3" "$1/ours" "$items" > /dev/null
  /usr/bin/time -f "noop_study: %e s passed, %U + %S s of processor, %M kB" "$3" "$1/ours" "$items"
fi
