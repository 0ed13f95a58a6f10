#!/usr/bin/env python3
"""Raises the version: of all packages and of what they ask of each other, of CITATION.cff and of the container file; the changelog's
`Unreleased` becomes the version with its date.

    scripts/version.py 0.2.0 [DATE]
"""

import datetime
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def change(name, pattern, words, least=1):
    """Puts words in place of a pattern, which a file must hold so often at least."""
    path = ROOT / name
    text, count = re.subn(pattern, words, path.read_text(), flags=re.MULTILINE)
    if count < least:
        sys.exit(f"version: {name} has nothing like {pattern!r}; it was changed, change this script, too")
    path.write_text(text)


def main():
    if len(sys.argv) < 2 or not re.fullmatch(r"\d+\.\d+\.\d+", sys.argv[1]):
        sys.exit(__doc__)
    version = sys.argv[1]
    date = sys.argv[2] if len(sys.argv) > 2 else datetime.date.today().isoformat()
    old = re.search(r'^version = "(.*)"', (ROOT / "Cargo.toml").read_text(), re.MULTILINE).group(1)
    if not re.search(r"^## Unreleased$", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE):
        sys.exit("version: CHANGELOG.md has no section Unreleased; write what is new first")
    change("Cargo.toml", rf'^version = "{re.escape(old)}"', f'version = "{version}"')
    change("Cargo.toml", rf'version = "={re.escape(old)}"', f'version = "={version}"', 2)
    change("CITATION.cff", rf"^version: {re.escape(old)}$", f"version: {version}")
    change("scripts/Containerfile", rf"radwalk:{re.escape(old)}", f"radwalk:{version}")
    change("CHANGELOG.md", r"^## Unreleased$", f"## {version} ({date})")
    subprocess.run(["cargo", "update", "--workspace", "--offline", "--quiet"], cwd=ROOT, check=True)
    print(f"version {old} → {version}; commit it, and tag it: git tag -a v{version} -m 'radwalk {version}'")


if __name__ == "__main__":
    main()
