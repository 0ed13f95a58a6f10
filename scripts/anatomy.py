#!/usr/bin/env python3
"""Lines of each crate, functions above 60 lines, files above 500, and circles of files. Tests are left out.

Usage: scripts/anatomy.py [--max 60] [CRATE ...]
       scripts/anatomy.py --homonyms          names of types that stand for more than one thing, with their files
"""
import collections, os, re, sys, subprocess

ROOT = subprocess.run(["git", "rev-parse", "--show-toplevel"], capture_output=True, text=True).stdout.strip()
STRINGS = re.compile(
    r'//[^\n]*|/\*.*?\*/|b?r(#*)".*?"\1|b?"(?:\\.|[^"\\])*"|b?\'(?:\\(?:x..|u\{[^}]*\}|.)|[^\'\\\n])\'', re.S)

def bare(text):
    """The text with comments and strings blanked, so that braces count."""
    blank = lambda m: re.sub(r'[^\n]', ' ', m.group(0))
    return STRINGS.sub(blank, text)

def closing(text, start):
    """The index behind the brace that closes the one at `start`."""
    depth = 0
    for i in range(start, len(text)):
        depth += (text[i] == '{') - (text[i] == '}')
        if depth == 0:
            return i + 1
    return len(text)

def without_tests(text):
    for m in reversed(list(re.finditer(r'#\[cfg\((?:all\()?test[^\]]*\]\s*(?:#\[[^\]]*\]\s*)*(?:pub(?:\([^)]*\))?\s+)?mod\s+\w+\s*([;{])', text))):
        end = m.end() if m.group(1) == ';' else closing(text, m.end() - 1)
        text = text[:m.start()] + re.sub(r'[^\n]', ' ', text[m.start():end]) + text[end:]
    return text

def functions(text):
    for m in re.finditer(r'\bfn\s+(\w+)', text):
        i, depth = m.end(), 0
        while i < len(text) and not (depth == 0 and text[i] in '{;'):
            depth += (text[i] in '([') - (text[i] in ')]')
            i += 1
        if i < len(text) and text[i] == '{':
            yield m.group(1), text.count('\n', 0, m.start()) + 1, text.count('\n', m.start(), closing(text, i)) + 1

def crates():
    yield 'root', os.path.join(ROOT, 'src')
    for name in sorted(os.listdir(os.path.join(ROOT, 'crates'))):
        yield name, os.path.join(ROOT, 'crates', name, 'src')

def modules(src):
    """Module path -> file."""
    found = {}
    for folder, _, files in os.walk(src):
        for file in files:
            if file.endswith('.rs'):
                path = os.path.join(folder, file)
                parts = os.path.relpath(path, src)[:-3].split(os.sep)
                if parts[-1] in ('mod', 'lib', 'main'):
                    parts.pop()
                found[tuple(parts)] = path
    return found

def uses(text, module):
    """Absolute paths that a file names: of `use`, and paths in the text."""
    def absolute(parts):
        base = list(module)
        if parts[0] == 'crate':
            return tuple(parts[1:])
        while parts and parts[0] in ('super', 'self'):
            if parts[0] == 'super':
                base = base[:-1]
            parts = parts[1:]
        return tuple(base) + tuple(parts)
    def tree(prefix, body):
        body = body.strip()
        depth, start, items = 0, 0, []
        for i, c in enumerate(body):
            depth += (c == '{') - (c == '}')
            if c == ',' and depth == 0:
                items.append(body[start:i]); start = i + 1
        items.append(body[start:])
        for item in filter(None, (x.strip() for x in items)):
            if '{' in item:
                head, rest = item.split('{', 1)
                yield from tree(prefix + [p for p in head.strip().split('::') if p], rest.rsplit('}', 1)[0])
            else:
                item = re.sub(r'\s+as\s+\w+', '', item)
                parts = prefix + item.split('::')
                yield parts[:-1] if parts[-1] == 'self' and len(parts) > 1 else parts
    seen = set()
    for m in re.finditer(r'\b(pub(?:\([^)]*\))?\s+)?use\s+([^;]+);', text):
        for parts in tree([], m.group(2)):
            parts = [p.strip() for p in parts]
            if parts[0] in ('crate', 'super', 'self'):
                seen.add((bool(m.group(1)), absolute(parts)))
            else:
                seen.add((bool(m.group(1)), tuple(module) + tuple(parts)))
    for m in re.finditer(r'\b(?:crate|super|self)(?:::\w+)+', text):
        seen.add((False, absolute(m.group(0).split('::'))))
    return seen

def circles(src):
    files = modules(src)
    texts = {m: without_tests(bare(open(p).read())) for m, p in files.items()}
    exported = {}
    for module, text in texts.items():
        for public, path in uses(text, module):
            if public:
                exported[module + (path[-1],)] = path
    declared = lambda path: any(re.search(r'\bmod\s+%s\b' % path[n], texts.get(path[:n], '')) for n in range(len(path)))
    def home(path, depth=0):
        for n in range(len(path), -1, -1):
            if depth < 9 and path[:n] in exported and path[:n] not in files:
                return home(exported[path[:n]] + path[n:], depth + 1)
        for n in range(len(path), -1, -1):
            if path[:n] in files:
                return path[:n] if n or len(path) else None
        return None
    edges = {m: set() for m in files}
    for module, text in texts.items():
        for public, path in uses(text, module):
            if public:
                continue
            to = home(path)
            if to is not None and to != module and (to != () or path[:1] != ()):
                # A path that names nothing of this crate falls to the root: another crate's.
                if to == () and not re.search(r'\b(?:fn|struct|enum|trait|const|static|type)\s+%s\b' % re.escape(path[0] if path else '_'), texts[()] if () in texts else ''):
                    continue
                if to == module[:len(to)] and to:
                    # A child that uses its own folder's mod.rs.
                    name = path[len(to)] if len(path) > len(to) else ''
                    if not re.search(r'\b(?:fn|struct|enum|trait|const|static|type)\s+%s\b' % re.escape(name or '_'), texts[to]):
                        continue
                edges[module].add(to)
    index, low, stack, on, out = {}, {}, [], set(), []
    def connect(v):
        index[v] = low[v] = len(index); stack.append(v); on.add(v)
        for w in sorted(edges[v]):
            if w not in index:
                connect(w); low[v] = min(low[v], low[w])
            elif w in on:
                low[v] = min(low[v], index[w])
        if low[v] == index[v]:
            part = []
            while True:
                w = stack.pop(); on.discard(w); part.append(w)
                if w == v:
                    break
            if len(part) > 1:
                out.append(sorted('/'.join(p) or 'lib' for p in part))
    sys.setrecursionlimit(10000)
    for v in sorted(edges):
        if v not in index:
            connect(v)
    return out

def homonyms():
    """Names that more than one struct, enum, trait, union or alias has; associated types of traits do not count."""
    places = collections.defaultdict(list)
    for _, src in crates():
        for path in modules(src).values():
            if path.endswith('/tests.rs') or '/tests/' in path:
                continue
            for m in re.finditer(r'^([ \t]*)(?:pub(?:\([^)]*\))?\s+)?(struct|enum|trait|union|type)\s+(\w+)', without_tests(bare(open(path).read())), re.M):
                if m.group(2) != 'type' or not m.group(1):
                    places[m.group(3)].append(os.path.relpath(path, ROOT))
    several = {name: paths for name, paths in places.items() if len(paths) > 1}
    print(f'{len(places)} names, {len(several)} of them stand for more than one thing')
    for name, paths in sorted(several.items(), key=lambda item: (-len(item[1]), item[0])):
        print(f'{len(paths):4} {name}: {" ".join(paths)}')

def main():
    most, names = 60, sys.argv[1:]
    if names[:1] == ['--homonyms']:
        return homonyms()
    if names[:1] == ['--max']:
        most, names = int(names[1]), names[2:]
    for name, src in crates():
        if names and name not in names:
            continue
        lines, long, large = 0, [], []
        for folder, _, files in os.walk(src):
            for file in sorted(files):
                if not file.endswith('.rs'):
                    continue
                path = os.path.join(folder, file)
                raw = open(path).read()
                lines += raw.count('\n')
                if raw.count('\n') > 500:
                    large.append(os.path.relpath(path, ROOT))
                long += [(n, os.path.relpath(path, ROOT), l, f) for f, l, n in functions(without_tests(bare(raw))) if n > most]
        rings = circles(src)
        print(f'{name}: {lines} lines, {len(large)} files above 500 lines, {len(long)} functions above {most}, {len(rings)} circles')
        for n, path, line, f in sorted(long, reverse=True):
            print(f'    {n:4} {path}:{line} {f}')
        for ring in rings:
            print('    circle:', ' '.join(ring))

main()
