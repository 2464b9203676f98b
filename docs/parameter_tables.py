#!/usr/bin/env python3
"""parameter_tables.py PROGRAM [--check]: the parameter table of each stage's README, made from what the program says.

It stands between the two marks below. --check writes nothing and fails when a table has fallen behind."""
import json, pathlib, subprocess, sys

BEGIN, END = "<!-- parameters: docs/parameter_tables.py -->", "<!-- end -->"


def asked(program, *words):
    return json.loads(subprocess.run([program, *words, "--json"], capture_output=True, check=True).stdout)


def table(fields):
    rows = ["| parameter | default | takes | |", "|---|---|---|---|"]
    for field in fields:
        cells = [f"`{field['name']}`", f"`{field['default']}`", field["type"], field["help"]]
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(rows)


def main(program, *options):
    behind = []
    root = pathlib.Path(__file__).resolve().parent.parent
    for stage in [s["stage"] for s in asked(program, "stages")["stages"]]:
        page = root / "stages" / stage / "README.md"
        if not page.exists():
            continue
        text = page.read_text()
        if text.count(BEGIN) != 1 or text.count(END) != 1:
            behind.append(f"{page.relative_to(root)}: has no place for its table: {BEGIN} {END}")
            continue
        head, rest = text.split(BEGIN)
        fields = asked(program, "params", stage)["fields"]
        body = table(fields) if fields else "No parameters."
        new = head + BEGIN + "\n" + body + "\n" + END + rest.split(END)[1]
        if new != text and "--check" in options:
            behind.append(f"{page.relative_to(root)}: the table has fallen behind: run docs/parameter_tables.py")
        elif new != text:
            page.write_text(new)
    print("\n".join(behind) or "all tables are up to date")
    return 1 if behind else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
