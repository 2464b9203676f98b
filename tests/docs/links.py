#!/usr/bin/env python3
"""links.py ROOT: every relative link and picture of every page of the project leads to a file that is there."""
import pathlib, re, subprocess, sys

root = pathlib.Path(sys.argv[1])
pages = subprocess.run(["git", "ls-files", "*.md"], cwd=root, capture_output=True, text=True, check=True).stdout.split()
links, broken = 0, []
for page in pages:
    text = re.sub(r"```.*?```|`[^`\n]*`", "", (root / page).read_text(), flags=re.S)
    for link in re.findall(r"\]\(([^)#\s]+)[^)]*\)", text):
        if not re.match(r"\w+:", link):
            links += 1
            if not (root / page).parent.joinpath(link).exists():
                broken.append(f"{page}: {link} is not there")
print("\n".join(broken + [f"{links} links of {len(pages)} pages, {len(broken)} broken"]))
sys.exit(1 if broken or not links else 0)
