#!/usr/bin/env python3
"""Loss of power: what an output folder may hold after one, and whether a run goes on from it to the same bytes.

    scripts/power_loss.py [--states 200] [--seed 48] [--radwalk target/release/radwalk] [--only PRODUCT] [--keep FOLDER]

Each product is made once undisturbed, and once under strace, where it is killed half-way and resumed. The log of system calls tells what was written,
renamed and synced, and in which order. A loss of power at one moment of it keeps all that was synced before, as POSIX has it: bytes of a file by fsync
of the file, names by fsync of their folder, a new folder by fsync of the one around it. Of everything else any part may be there: writes are kept,
dropped, torn half-way or left as zeros; changes of names are kept up to one of them, or each by lot. Each renaming is whole.

States are drawn with a seed, half of them beside a sync or a renaming, and no two are equal. The command is run again with --resume in each. It must
end as the undisturbed one did, and its files must have the same bytes. It must go on from at least as many paths as a state has that keeps nothing but
what was synced. Where the folder held another run's result, the command may refuse in words and then leaves each file as it was, but for drafts that a
crash has left. At the end of a run that has succeeded, what was synced alone must be the result.

What this does not model: blocks that the disk acknowledged and lost, and file systems that lose what was synced.
Needs Linux and strace. Exits with 1 where a state fails; --keep has these states.
"""

import argparse
import hashlib
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TRACED = (
    "open,openat,creat,write,writev,pwrite64,pwritev,pwritev2,ftruncate,truncate,fallocate,lseek,fsync,fdatasync,sync,syncfs,"
    "sync_file_range,msync,mmap,copy_file_range,sendfile,splice,rename,renameat,renameat2,link,linkat,symlink,symlinkat,"
    "unlink,unlinkat,rmdir,mkdir,mkdirat"
)
# The longest that a command may take [s].
LONGEST = 300

RUN = " --set view.size=[64,48] --set budget.checkpoint_seconds=0.1"
OPENING = """[material.wall]
reflectance = 0.8
[[surface]]
name = "wall"
material = "wall"
sides = 2
quad = [[0,3,0], [3,3,0], [0,3,2]]
[[sensor]]
name = "desk"
quad = [[1,1,0.5], [2,1,0.5], [1,2,0.5]]
patches = [2, 2]
"""
CUBE = "tests/data/cube54.toml"

# Name: the command, and the files whose bytes are a function of the job. `{}` stands for the folder with the scenes that are made here.
PRODUCTS = {
    "walks": (f"run {CUBE} --paths 6000000" + RUN, ["patches.csv", "radiosity.png"]),
    "over another run": (f"run {CUBE} --paths 6000000" + RUN, ["patches.csv", "radiosity.png"]),
    "auto patches": (
        "run configs/scenes/lamps.toml --set scene.patches=auto --paths 3000000" + RUN,
        ["patches.csv", "partition.toml", "radiosity.png"],
    ),
    "factors, dense": (
        f"factors {CUBE} --reflections --tolerance 0.02 --paths 30000000",
        ["factors.csv", "groups.csv"],
    ),
    "factors, sparse": (f"factors {CUBE} --sparse --reflections --rays 100000", ["factors.mtx", "groups.csv"]),
    "daylight": (
        "daylight {}/opening.toml --weather configs/weather/made.epw --tolerance 0.004 --paths 40000000",
        ["annual.csv", "annual.ill", "coefficients.mtx"],
    ),
}
# The product that is made over an older result, which it replaces.
OVER = "over another run"


class Unmodelled(Exception):
    """A system call on the folder whose effect this script does not know."""


# --- The log ---------------------------------------------------------------------------------------------------------


def text(hexed):
    """The bytes that strace writes as \\xHH."""
    return bytes.fromhex(hexed.replace("\\x", ""))


LINE = re.compile(r"^(\d+) +(.*)$")
CALL = re.compile(r"^(\w+)\((.*)\) += (-?\d+|0x[0-9a-f]+|\?)(.*)$")
HEX = r"(?:\\x[0-9a-f]{2})*"
# A descriptor with the path of its file. A file without a name any more has "(deleted)" behind it.
OPEN = re.compile(rf"^(?:-?\d+|AT_FDCWD)<({HEX})>(\(deleted\))?")
STRING = re.compile(rf'"({HEX})"')


def calls(log):
    """The system calls of a log in the order in which they ended: (line of the beginning, line of the end, name, arguments, result, rest)."""
    begun = {}
    for number, line in enumerate(log):
        match = LINE.match(line.rstrip("\n"))
        if not match:
            continue
        process, rest = match.groups()
        start = number
        if rest.endswith("<unfinished ...>"):
            begun[process] = (number, rest[: -len("<unfinished ...>")])
            continue
        if rest.startswith("<... "):
            start, head = begun.pop(process)
            rest = head + rest.split(" resumed>", 1)[1]
        call = CALL.match(rest)
        if call:
            yield start, number, *call.groups()


class Op:
    """A change of the folder, or a sync of a file or folder, which keeps those that ended before it began."""

    def __init__(self, kind, node, begin, end, what=None):
        self.kind, self.node, self.begin, self.end, self.what = kind, node, begin, end, what


class Recording:
    """What the calls of a log did to a folder: names are kept in folders, bytes in nodes."""

    def __init__(self, root):
        self.root = str(root)
        self.ops = []
        self.names = {0: {}}
        self.sizes = {}
        self.places = {}
        self.line = 0
        self._seed(root, 0)
        # What stood there before was kept long ago.
        nodes = [*self.names, *self.sizes]
        self.ops += [Op("sync", node, self.line + 1, self.line + 1) for node in nodes]
        self.line += 2

    def _seed(self, path, folder):
        for entry in sorted(os.scandir(path), key=lambda entry: entry.name):
            if entry.is_dir():
                self._name(folder, [(entry.name, self._node(True))], 0, 0)
                self._seed(entry.path, self.names[folder][entry.name])
            else:
                node = self._node(False)
                self._name(folder, [(entry.name, node)], 0, 0)
                self._write(node, 0, Path(entry.path).read_bytes(), 0, 0)

    def _node(self, is_folder):
        node = len(self.names) + len(self.sizes)
        if is_folder:
            self.names[node] = {}
        else:
            self.sizes[node] = 0
        return node

    def _name(self, folder, changes, begin, end):
        for name, node in changes:
            if node is None:
                self.names[folder].pop(name, None)
            else:
                self.names[folder][name] = node
        self.ops.append(Op("names", folder, begin, end, changes))

    def _write(self, node, at, content, begin, end):
        self.sizes[node] = max(self.sizes[node], at + len(content))
        self.ops.append(Op("write", node, begin, end, (at, content)))

    def _cut(self, node, size, begin, end):
        self.sizes[node] = size
        self.ops.append(Op("size", node, begin, end, size))

    def _is_here(self, path):
        return path == self.root or path.startswith(self.root + "/")

    def _find(self, path):
        """The folder of a path, the name in it, and the node of that name, if any."""
        parts = [part for part in path[len(self.root) :].split("/") if part]
        folder = 0
        if not parts:
            return None, None, 0
        for part in parts[:-1]:
            folder = self.names[folder][part]
        return folder, parts[-1], self.names[folder].get(parts[-1])

    def read(self, log):
        """Adds the calls of a log."""
        last = self.line
        for begin, end, name, words, result, _ in calls(log):
            last = self.line + end + 1
            failed = result.startswith("-1") or result == "?"
            if not failed:
                self._call(self.line + begin, self.line + end, name, words, int(result, 0))
        self.line = last + 1

    def _call(self, begin, end, name, words, result):
        opened = OPEN.match(words)
        strings = [text(found) for found in STRING.findall(words)]
        of_descriptor = name in {
            "write", "writev", "pwrite64", "pwritev", "pwritev2", "ftruncate", "fallocate", "lseek", "fsync", "fdatasync", "syncfs", "sync_file_range"
        }  # fmt: skip
        if of_descriptor:
            if not opened or opened[2]:
                return
            path = text(opened[1]).decode(errors="surrogateescape")
            if not self._is_here(path):
                return
            _, _, node = self._find(path)
            if node is None:
                return
            return self._bytes(begin, end, name, words, strings, result, node)
        if name in {"mmap", "copy_file_range", "sendfile", "splice", "sync", "msync"}:
            here = any(self._is_here(text(found).decode(errors="surrogateescape")) for found in re.findall(rf"<({HEX})>", words))
            if here and not (name == "mmap" and ("MAP_PRIVATE" in words or "PROT_WRITE" not in words)):
                raise Unmodelled(f"{name}({words[:200]}")
            return
        paths = [self._absolute(words, string) for string in strings]
        if not any(self._is_here(path) for path in paths):
            return
        found = [self._find(path) for path in paths]
        folder, last, node = found[0]
        if name in {"open", "openat", "creat"}:
            if "O_TMPFILE" in words:
                raise Unmodelled("O_TMPFILE")
            if "O_CREAT" in words or name == "creat":
                if node is None:
                    node = self._node(False)
                    self._name(folder, [(last, node)], begin, end)
            if node in self.sizes:
                self.places[node] = None if "O_APPEND" in words else 0
                if "O_TRUNC" in words and self.sizes[node]:
                    self._cut(node, 0, begin, end)
        elif name in {"mkdir", "mkdirat"}:
            self._name(folder, [(last, self._node(True))], begin, end)
        elif name in {"unlink", "unlinkat", "rmdir"}:
            self._name(folder, [(last, None)], begin, end)
        elif name in {"link", "linkat"}:
            self._in_one(found)
            self._name(folder, [(found[1][1], node)], begin, end)
        elif name in {"rename", "renameat", "renameat2"} and "EXCHANGE" not in words:
            self._in_one(found)
            # Two names of one file: renaming does nothing.
            if found[0][2] != found[1][2]:
                self._name(folder, [(last, None), (found[1][1], node)], begin, end)
        else:
            raise Unmodelled(f"{name}({words[:200]}")

    def _in_one(self, found):
        if found[0][0] != found[1][0]:
            raise Unmodelled("a name that moves to another folder")

    def _absolute(self, words, string):
        path = string.decode(errors="surrogateescape")
        base = OPEN.match(words)
        return path if path.startswith("/") or not base else os.path.join(text(base[1]).decode(errors="surrogateescape"), path)

    def _bytes(self, begin, end, name, words, strings, result, node):
        if name in {"fsync", "fdatasync"}:
            self.ops.append(Op("sync", node, begin, end))
        elif name in {"write", "writev"}:
            content = b"".join(strings)[:result]
            if len(content) != result:
                raise Unmodelled("a write that the log does not have whole")
            place = self.places[node]
            at = self.sizes[node] if place is None else place
            self._write(node, at, content, begin, end)
            if place is not None:
                self.places[node] = at + result
        elif name == "pwrite64":
            self._write(node, int(words.rsplit(", ", 1)[1]), strings[0][:result], begin, end)
        elif name == "ftruncate":
            self._cut(node, int(words.rsplit(", ", 1)[1]), begin, end)
        elif name == "lseek":
            if node in self.sizes and self.places.get(node) is not None:
                self.places[node] = result
        else:
            raise Unmodelled(f"{name}({words[:200]}")


# --- States that a loss of power may leave ---------------------------------------------------------------------------


def apply(content, op, share=1.0, zeros=False):
    """The bytes of a file after a write or a cut, or a part of a write."""
    if op.kind == "size":
        return content[: op.what] + bytes(max(0, op.what - len(content)))
    at, written = op.what
    written = written[: round(share * len(written))]
    written = bytes(len(written)) if zeros else written
    content = content + bytes(max(0, at - len(content)))
    return content[:at] + written + content[at + len(written) :]


def state(recording, end, dice):
    """The files and folders after a loss of power behind `end` operations: {path: bytes, or None for a folder}. Without `dice`, what was synced alone."""
    ops, synced = recording.ops[:end], {}
    for op in ops:
        if op.kind == "sync":
            synced[op.node] = max(op.begin, synced.get(op.node, -1))
    by_node = {}
    for op in ops:
        if op.kind != "sync":
            by_node.setdefault(op.node, []).append(op)
    folders, files = {0: {}}, {}
    for node, changes in by_node.items():
        # Operations of one node follow each other, so what a sync keeps comes first.
        kept = sum(op.end < synced.get(node, -1) for op in changes)
        sure, open_ones = changes[:kept], changes[kept:]
        if changes[0].kind == "names":
            way = dice.choice(["none", "all", "some", "each"]) if dice else "none"
            if way == "some":
                open_ones = open_ones[: dice.randint(0, len(open_ones))]
            elif way == "each":
                open_ones = [op for op in open_ones if dice.random() < 0.5]
            names = folders.setdefault(node, {})
            for op in sure + (open_ones if way != "none" else []):
                for name, other in op.what:
                    names.pop(name, None)
                    if other is not None:
                        names[name] = other
            continue
        content = b""
        for op in sure:
            content = apply(content, op)
        way = dice.choice(["none", "all", "torn", "zeros", "each"]) if dice else "none"
        if way == "torn" and open_ones:
            last = dice.randrange(len(open_ones))
            for op in open_ones[:last]:
                content = apply(content, op)
            content = apply(content, open_ones[last], share=dice.random()) if open_ones[last].kind == "write" else content
        elif way != "none":
            for op in open_ones:
                is_lost = way == "zeros" or (way == "each" and dice.random() < 0.5)
                content = apply(content, op, zeros=is_lost)
        files[node] = content
    tree = {}

    def walk(folder, prefix):
        for name, node in sorted(folders.get(folder, {}).items()):
            path = prefix + name
            if node in recording.names:
                tree[path] = None
                walk(node, path + "/")
            else:
                tree[path] = files.get(node, b"")

    walk(0, "")
    return tree


def write_tree(tree, root):
    for path, content in tree.items():
        if content is None:
            (root / path).mkdir(parents=True, exist_ok=True)
        else:
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            (root / path).write_bytes(content)


def read_tree(root):
    tree = {}
    for path in sorted(root.rglob("*")):
        tree[str(path.relative_to(root))] = None if path.is_dir() else path.read_bytes()
    return tree


def named(tree):
    """A tree without the drafts of files that were not placed under their names."""
    return {path: content for path, content in tree.items() if not re.search(r"(^|/)\.radwalk-[^/]*\.tmp$", path)}


# --- Runs ------------------------------------------------------------------------------------------------------------


class Bench:
    def __init__(self, args, folder):
        self.radwalk, self.args, self.folder = str(Path(args.radwalk).resolve()), args, folder
        self.scenes = folder / "scenes"
        self.scenes.mkdir()
        (self.scenes / "opening.toml").write_text(OPENING)

    def words(self, command, out, more=()):
        words = command.replace("{}", str(self.scenes)).split(" ")
        return [self.radwalk, *words, *more, "--out", str(out)]

    def run(self, words):
        return subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=LONGEST)

    def trace(self, words, log, seconds=None):
        """Runs a command under strace; kills it and all its processes after some seconds."""
        strace = ["strace", "-f", "-y", "-xx", "-s", str(1 << 26), "--seccomp-bpf", "-e", f"trace={TRACED}", "-o", str(log), *words]
        process = subprocess.Popen(strace, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True)
        try:
            process.communicate(timeout=seconds or LONGEST)
            return process.returncode
        except subprocess.TimeoutExpired:
            # strace goes on until all that it follows are gone.
            for child in Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split():
                os.kill(int(child), signal.SIGKILL)
            process.communicate(timeout=LONGEST)
            return None


def digest(tree):
    hashed = hashlib.sha256()
    for path, content in tree.items():
        hashed.update(repr((path, content)).encode())
    return hashed.hexdigest()


def paths_resumed(said):
    found = re.search(r"resumed after (\d+) paths", said)
    return int(found[1]) if found else 0


class Trial:
    """One product."""

    def __init__(self, bench, name, states, seed):
        self.bench, self.name = bench, name
        self.command, self.files = PRODUCTS[name]
        self.wanted, self.seed = states, seed
        self.folder = bench.folder / name.replace(" ", "-").replace(",", "")
        self.folder.mkdir()
        self.floors, self.lock = {}, threading.Lock()
        self.faults = []

    def result(self, out):
        files = {name: (out / name).read_bytes() if (out / name).exists() else None for name in self.files}
        if (out / "summary.json").exists():
            files["tally"] = re.findall(r'"tally_hash": *"(\w+)"', (out / "summary.json").read_text())
        return files

    def prepare(self):
        bench, calm = self.bench, self.folder / "calm"
        began = time.monotonic()
        done = bench.run(bench.words(self.command, calm))
        took = time.monotonic() - began
        assert done.returncode in (0, 2), f"{self.name}: {done.stderr}"
        self.code, self.calm = done.returncode, self.result(calm)
        assert None not in self.calm.values(), self.calm.keys()
        # The same command under strace, killed once and resumed.
        root = self.folder / "traced"
        root.mkdir()
        out, more = root / "out", []
        if self.name == OVER:
            assert bench.run(bench.words(self.command, out, ["--set", "seed=7"])).returncode == self.code
            more = ["--force"]
        self.older = read_tree(root)
        recording = Recording(root)
        logs = [self.folder / "first.log", self.folder / "second.log"]
        self.killed = bench.trace(bench.words(self.command, out, more), logs[0], seconds=0.4 + 0.6 * took) is None
        # Where it had not begun, there is nothing of its own to go on from yet.
        code = bench.trace(bench.words(self.command, out, ["--resume"]), logs[1])
        assert code == self.code, f"{self.name}: {code} when it is resumed after a kill"
        for log in logs:
            with open(log, errors="surrogateescape") as lines:
                recording.read(lines)
            log.unlink()
        self.recording, self.ops = recording, recording.ops
        # The model itself is tried: all that was written, in its order, is what is there.
        there, model = read_tree(root), state(self.recording, len(self.ops), KeepAll())
        differ = sorted(path for path in {*there, *model} if there.get(path, 0) != model.get(path, 0))
        assert not differ, f"{self.name}: the log does not give {differ}"
        self.check_end()

    def check_end(self):
        """What was synced when the run had ended is the result."""
        root = self.folder / "end"
        root.mkdir()
        write_tree(state(self.recording, len(self.ops), None), root)
        kept = self.result(root / "out")
        lost = sorted(name for name, content in self.calm.items() if kept.get(name) != content)
        if lost:
            self.faults.append(f"a finished run is not safe: {', '.join(lost)} can be lost")

    def draw(self):
        """States to try, no two of them equal: (moment, tree)."""
        dice = random.Random(f"{self.seed} {self.name}")
        # What was there before is no moment.
        first = next(i for i, op in enumerate(self.ops) if op.begin > 1)
        edges = [i + j for i, op in enumerate(self.ops) if i >= first and op.kind in {"sync", "names"} for j in (0, 1)]
        seen, drawn = set(), []
        for _ in range(20 * self.wanted):
            if len(drawn) == self.wanted:
                break
            end = dice.choice(edges) if dice.random() < 0.5 else dice.randint(first, len(self.ops))
            tree = state(self.recording, end, dice)
            key = digest(tree)
            if key not in seen:
                seen.add(key)
                drawn.append((end, tree))
        return drawn

    def resume(self, tree, place):
        root = self.folder / place
        root.mkdir()
        write_tree(tree, root)
        done = self.bench.run(self.bench.words(self.command, root / "out", ["--resume"]))
        return root, done

    def floor(self, end):
        """The paths that a state must go on from: those of what was synced."""
        tree = state(self.recording, end, None)
        key = digest({path: content for path, content in tree.items() if path.startswith("out/tally")})
        with self.lock:
            if key not in self.floors:
                root, done = self.resume(tree, f"floor-{key[:16]}")
                self.floors[key] = paths_resumed(done.stderr)
                shutil.rmtree(root)
            return self.floors[key]

    def attempt(self, number, end, tree):
        """What is wrong with what becomes of a state; None where all is well. Also whether it was refused."""
        root, done = self.resume(tree, f"state-{number}")
        fault, refused = None, False
        said = done.stdout + done.stderr
        if "panicked" in said or done.returncode < 0:
            fault = f"it panics: {said[-600:]}"
        elif done.returncode != self.code:
            refused = self.name == OVER and self.is_older(tree) and named(read_tree(root)) == named(tree)
            fault = None if refused else f"exit code {done.returncode}: {said[-600:]}"
        elif self.result(root / "out") != self.calm:
            fault = "other bytes"
        elif self.command.startswith("run") and (went := paths_resumed(done.stderr)) < (floor := self.floor(end)):
            fault = f"it goes on from {went} paths, and {floor} were safe"
        if fault and self.bench.args.keep:
            keep = Path(self.bench.args.keep) / f"{self.folder.name}-{number}"
            keep.mkdir(parents=True, exist_ok=True)
            write_tree(tree, keep)
        shutil.rmtree(root)
        return fault, refused

    def is_older(self, tree):
        """Whether the older result is there, unharmed."""
        return all(tree.get(f"out/{name}") == self.older[f"out/{name}"] for name in ["tally.bin"])

    def go(self):
        began = time.monotonic()
        self.prepare()
        states = self.draw()
        with ThreadPoolExecutor(self.bench.args.jobs) as pool:
            tried = list(pool.map(lambda each: self.attempt(each[0], *each[1]), enumerate(states)))
        refused = sum(refused for _, refused in tried)
        self.faults += [f"state {i}, after {states[i][0]} of {len(self.ops)} operations: {fault}" for i, (fault, _) in enumerate(tried) if fault]
        syncs = sum(op.kind == "sync" for op in self.ops)
        print(
            f"{self.name}: {len(self.ops)} operations, {syncs} of them syncs{', killed once' if self.killed else ''}; {len(states)} states, "
            f"{len(states) - refused - sum(bool(fault) for fault, _ in tried)} come to the same bytes, {refused} refused in words over an older result, "
            f"{len(self.faults)} faults, {time.monotonic() - began:.0f} s",
            flush=True,
        )
        for fault in self.faults:
            print(f"  {fault}", flush=True)
        return len(states), len(self.faults)


class KeepAll:
    """Dice that lose nothing."""

    def choice(self, _):
        return "all"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--states", type=int, default=200, help="states of all products together")
    parser.add_argument("--seed", type=int, default=48)
    parser.add_argument("--radwalk", default=str(ROOT / "target/release/radwalk"))
    parser.add_argument("--only", action="append", choices=list(PRODUCTS))
    parser.add_argument("--keep", help="where states that fail are kept")
    parser.add_argument("--jobs", type=int, default=2, help="commands at a time")
    args = parser.parse_args()
    if not shutil.which("strace"):
        sys.exit("power_loss.py needs strace; install the package strace")
    chosen = args.only or list(PRODUCTS)
    each = -(-args.states // len(chosen))
    with tempfile.TemporaryDirectory(prefix="power-loss-") as folder:
        bench = Bench(args, Path(folder).resolve())
        totals = [Trial(bench, name, each, args.seed).go() for name in chosen]
    states, faults = (sum(column) for column in zip(*totals))
    print(f"{states} states of {len(chosen)} products after a loss of power: {faults} faults")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
