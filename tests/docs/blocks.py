#!/usr/bin/env python3
"""Executes the code blocks of a page of documentation: blocks.py PROGRAM PAGE.md

```sh     every line runs in bash, in one folder a page; a failing line fails the page
```toml   must parse, and every [stage] table and "stage.field" of a sweep must exist
```json   must parse
a line that is only `some/file`: before a block writes the block to that file
```console and others are for reading.

The folder holds what pages speak of: mug.ply (a thick ring), my_flow.toml, my_hand, a.csv, b.csv, grasp.json, scene.toml
(that of docs/planning.md), folder/of/meshes.
`geocage run` of anything but my_flow.toml only plans (--dry-run): the real runs are the business of other tests."""
import json, math, os, pathlib, re, shutil, subprocess, sys, tempfile, tomllib

SHIM = """#!/bin/bash
if [ "$1" = run ] && [[ " $* " != *" my_flow.toml "* ]]; then set -- "$@" --dry-run; fi
{program} "$@"
code=$?
[ $code = 1 ] || exit $code  # 1: some items were rejected or skipped, such as objects that need a network
"""
FLOW = """objects = ["mug.ply"]
hands = ["schunk_sdh"]
[scan]
views = 3
[remesh]
edge_length_m = 0.008
[place]
max_grasps = 1
[evaluate]
control_grasps = 1
[cage]
wrench_seeds = 1
control_grasps = 1
"""


def ring(file, radius_m=0.05, tube_m=0.012, n=48, m=16):
    """A torus as PLY text: a solid of genus 1 that a hand can hold."""
    corners, faces = [], []
    for i in range(n):
        for j in range(m):
            u, v = 2 * math.pi * i / n, 2 * math.pi * j / m
            r = radius_m + tube_m * math.cos(v)
            corners.append(f"{r * math.cos(u)} {r * math.sin(u)} {tube_m * math.sin(v)}")
            a, b, c, d = i * m + j, (i + 1) % n * m + j, (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m
            faces += [f"3 {a} {b} {c}", f"3 {a} {c} {d}"]
    header = ["ply", "format ascii 1.0", f"element vertex {len(corners)}", "property float x", "property float y",
              "property float z", f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    file.write_text("\n".join(header + corners + faces) + "\n")


def blocks_of(text):
    """(first line number, language, file to write or None, code) of each fenced block."""
    lines = text.split("\n")
    i = 0
    while i < len(lines):
        if match := re.match(r"```(\w*)", lines[i]):
            end = next(j for j in range(i + 1, len(lines)) if lines[j].startswith("```"))
            before = next((line for line in reversed(lines[:i]) if line.strip()), "")
            name = re.match(r"^`([\w./-]+)`:$", before)
            yield i + 1, match[1], name and name[1], "\n".join(lines[i + 1:end]) + "\n"
            i = end
        i += 1


def prepare(program, folder):
    ring(folder / "mug.ply")
    (folder / "folder/of/meshes").mkdir(parents=True)
    ring(folder / "folder/of/meshes/ring.ply", 0.06)
    (folder / "a.csv").write_text("0,0,-1\n0,0,1\n")
    (folder / "b.csv").write_text("1,0,0\n0,1,0\n-1,0,0\n")
    (folder / "my_flow.toml").write_text(FLOW)
    planning = (pathlib.Path(__file__).parents[2] / "docs/planning.md").read_text()
    (folder / "scene.toml").write_text(next(code for _, _, file, code in blocks_of(planning) if file == "scene.toml"))
    shutil.copytree(pathlib.Path(__file__).parents[2] / "hands/schunk_sdh", folder / "my_hand")
    (folder / "bin").mkdir()
    shim = folder / "bin/geocage"
    shim.write_text(SHIM.format(program=program))
    shim.chmod(0o755)


def run(code, folder, env):
    return subprocess.run(["bash", "-e", "-o", "pipefail", "-c", code], cwd=folder, env=env, text=True, capture_output=True)


def first_grasp(folder, env):
    """The best grasp of my_flow.toml as grasp.json."""
    made = run("geocage run my_flow.toml --quiet > /dev/null && geocage show mug/place/schunk_sdh --json", folder, env)
    if made.returncode != 0:
        sys.exit(f"my_flow.toml of the tests: {made.stderr}")
    grasps = pathlib.Path(folder, json.loads(made.stdout)["folder"], "grasps.json")
    (folder / "grasp.json").write_text(grasps.read_text())


def fields_of(program):
    stages = json.loads(subprocess.run([program, "stages", "--json"], capture_output=True, check=True).stdout)["stages"]
    answer = {}
    for stage in [s["stage"] for s in stages]:
        params = subprocess.run([program, "params", stage, "--json"], capture_output=True, check=True).stdout
        answer[stage] = {field["name"] for field in json.loads(params)["fields"]}
    return answer


def flow_faults(code, known):
    """What a flow file in a page names that is not there."""
    flow = tomllib.loads(code)
    if "objects" not in flow and "sweep" not in flow:
        return []
    named = {(stage, field) for stage, table in flow.items() if stage in known for field in table}
    named |= {tuple(key.split(".")) for key in flow.get("sweep", {}) if "." in key}
    for tables in flow.get("object", {}).values():
        named |= {(stage, field) for stage, table in tables.items() for field in table}
    unknown = [key for key in flow if isinstance(flow[key], dict) and key not in known and key not in ("sweep", "object")]
    return unknown + [f"{s}.{f}" for s, f in sorted(named) if f not in known.get(s, {})]


def main(program, page):
    bad, ran = 0, 0
    program = os.path.abspath(program)
    blocks = list(blocks_of(pathlib.Path(page).read_text()))
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        prepare(program, folder)
        env = dict(os.environ, PATH=f"{folder}/bin:{os.environ['PATH']}", GEOCAGE_STORE=str(folder / "store"))
        if any(re.search("grasp.json|geocage (query|show|metrics)", code) for _, language, _, code in blocks if language == "sh"):
            first_grasp(folder, env)
        for line, language, file, code in blocks:
            fault = ""
            if file:
                (folder / file).parent.mkdir(parents=True, exist_ok=True)
                (folder / file).write_text(code)
            if language == "toml":
                fault = ", ".join(flow_faults(code, fields_of(program)))
            if language == "json":
                json.loads(code)
            if language == "sh":
                ended = run(code, folder, env)
                fault = ended.stderr if ended.returncode else ""
            bad += bool(fault)
            if language in ("sh", "toml", "json"):
                ran += 1
                print(f"{page}:{line}: {language}: {fault or 'good'}")
    print(f"{ran} blocks, {bad} bad")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
