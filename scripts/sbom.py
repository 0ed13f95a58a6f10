#!/usr/bin/env python3
"""The parts of the binary as a CycloneDX 1.5 document: what cargo links for a target, with licences and the checksums of Cargo.lock.

    scripts/sbom.py [TARGET] > radwalk.cdx.json

The same sources give the same bytes: neither time nor serial number is written.
"""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def metadata(target):
    words = ["cargo", "metadata", "--format-version", "1", "--locked", "--filter-platform", target]
    return json.loads(subprocess.run(words, cwd=ROOT, check=True, capture_output=True, text=True).stdout)


def linked(found, root):
    """Ids of packages that are linked, each with those that it links: neither build scripts nor tests, nor what procedural macros use."""
    nodes = {node["id"]: node for node in found["resolve"]["nodes"]}
    packages = {package["id"]: package for package in found["packages"]}
    macro = lambda id: any("proc-macro" in target["kind"] for target in packages[id]["targets"])
    graph, waiting = {}, [root]
    while waiting:
        id = waiting.pop()
        if id in graph:
            continue
        normal = [dep["pkg"] for dep in nodes[id]["deps"] if any(kind["kind"] is None for kind in dep["dep_kinds"])]
        graph[id] = sorted(dep for dep in normal if not macro(dep))
        waiting += graph[id]
    return graph, packages


def component(package, checksums):
    name, version = package["name"], package["version"]
    purl = f"pkg:cargo/{name}@{version}"
    entry = {"type": "library", "bom-ref": purl, "name": name, "version": version, "purl": purl}
    if package["license"]:
        # Old manifests have a slash for OR.
        entry["licenses"] = [{"expression": package["license"].replace("/", " OR ")}]
    if (name, version) in checksums:
        entry["hashes"] = [{"alg": "SHA-256", "content": checksums[name, version]}]
    return entry


def main():
    host = subprocess.run(["rustc", "-vV"], check=True, capture_output=True, text=True).stdout
    target = sys.argv[1] if len(sys.argv) > 1 else host.split("host: ")[1].split()[0]
    found = metadata(target)
    root = next(package["id"] for package in found["packages"] if package["name"] == "radwalk")
    graph, packages = linked(found, root)
    lock = tomllib.loads((ROOT / "Cargo.lock").read_text())
    checksums = {(entry["name"], entry["version"]): entry["checksum"] for entry in lock["package"] if "checksum" in entry}
    entries = {id: component(packages[id], checksums) for id in graph}
    ref = lambda id: entries[id]["bom-ref"]
    document = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {"component": entries[root] | {"type": "application"}, "properties": [{"name": "target", "value": target}]},
        "components": sorted((entries[id] for id in graph if id != root), key=lambda entry: entry["bom-ref"]),
        "dependencies": sorted(
            ({"ref": ref(id), "dependsOn": sorted(map(ref, others))} for id, others in graph.items()), key=lambda entry: entry["ref"]
        ),
    }
    json.dump(document, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
