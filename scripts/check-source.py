#!/usr/bin/env python3
"""Rules of the house that no compiler knows. Fails and says where, if one is broken.

    python3 scripts/check-source.py [circles|lines|names|readme ...] [--root FOLDER]     (default: all four)

circles  no two files of a crate import each other, over however many others: the graph has an arrow from a
         file to each file whose items it names (`use`, or a path in the code; a re-export is followed to where
         the item stands). What a folder's mod.rs defines is for the files in it, so arrows from them to it do
         not count, and tests may look at everything
lines    no .rs file is over 400 lines
names    at most 15 names of types stand for two things: a type is a struct, enum, union, trait or alias, outside tests
         and the programs of lab/
readme   README.md: at most 110 lines, none over 110 characters, no sentence over 35 words

Python, because this runs before anything is compiled, in a second, and needs nothing but python3.
"""

import argparse
import re
import sys
from collections import defaultdict
from pathlib import Path

LINES, NAMES, README_LINES, README_WIDTH, WORDS = 400, 15, 110, 110, 35

TOKEN = re.compile(
    r"""(?P<skip>\s+|//[^\n]*)|(?P<block>/\*)|(?P<raw>(?:b|c|br|cr)?r(?P<hashes>\#*)")|(?P<string>[bc]?"(?:[^"\\]|\\.)*")"""
    r"""|(?P<char>b?'(?:[^'\\]|\\(?:u\{[^}]*\}|x..|.))')|(?P<life>'\w+)|(?P<word>(?:r\#)?[A-Za-z_]\w*)|(?P<other>::|\d[\w.]*|.)""",
    re.DOTALL | re.VERBOSE,
)


def tokens(text):
    """Words and signs of Rust source, without comments; a string is one token `""`, or `"..."` after `path =`."""
    found, at = [], 0
    while at < len(text):
        match = TOKEN.match(text, at)
        at = match.end()
        kind = match.lastgroup if match.lastgroup != "hashes" else "raw"
        if kind == "block":  # block comments nest
            depth = 1
            while depth:
                inner = re.compile(r"/\*|\*/").search(text, at)
                if not inner:
                    return found
                depth, at = depth + (1 if inner.group() == "/*" else -1), inner.end()
        elif kind == "raw":
            at = text.index('"' + match["hashes"], at) + 1 + len(match["hashes"])
            found.append('""')
        elif kind == "string":
            found.append(match.group() if found[-2:] == ["path", "="] else '""')
        elif kind in ("word", "other"):
            found.append(match.group().removeprefix("r#"))
    return found


class Module:
    """A module: where it stands, what it defines, what it imports, and the paths that its code names."""

    def __init__(self, file, parent, name):
        self.file, self.parent, self.name = file, parent, name
        self.children, self.items, self.imports, self.globs, self.paths = {}, set(), {}, [], []
        self.types, self.words, self.left_out = [], set(), set()

    def root(self):
        return self if self.parent is None else self.parent.root()

    def all(self):
        yield self
        for child in self.children.values():
            yield from child.all()


ITEMS = {"fn", "struct", "enum", "union", "trait", "type", "const", "static", "macro_rules"}
TYPES = {"struct", "enum", "union", "trait", "type"}


def closing(words, at):
    """The place behind the bracket that closes the one at `at`."""
    pairs, depth = {"(": ")", "[": "]", "{": "}"}, 0
    for place in range(at, len(words)):
        if words[place] in pairs:
            depth += 1
        elif words[place] in pairs.values():
            depth -= 1
            if depth == 0:
                return place + 1
    return len(words)


def use_tree(words, at, prefix, found):
    """Reads a use tree into `found` as (path, name or None for a glob); gives the place behind it."""
    path = list(prefix)
    while at < len(words):
        word = words[at]
        if word == "{":
            at += 1
            while words[at] != "}":
                at = use_tree(words, at, path, found)
                at += words[at] == ","
            return at + 1
        if word == "*":
            found.append((path, None))
            return at + 1
        if word != "::":
            path.append(word)
            if at + 1 >= len(words) or words[at + 1] != "::":
                at += 1
                if path[-1] == "self" and len(path) > 1:
                    path.pop()
                name = path[-1]
                if at < len(words) and words[at] == "as":
                    name, at = words[at + 1], at + 2
                found.append((path, name))
                return at
        at += 1
    return at


def is_test(attribute):
    return attribute[:3] == ["cfg", "(", "test"] or attribute == ["test"] or attribute[:4] == ["cfg", "(", "all", "("] and "test" in attribute


def read_module(module, words, folder):
    """Fills `module` from its tokens; `folder` is where its child modules stand."""
    at, depth, attributes = 0, 0, []
    while at < len(words):
        word = words[at]
        if word == "#" and at + 1 < len(words):
            start = at + 1 + (words[at + 1] == "!")
            end = closing(words, start)
            attributes.append(words[start + 1 : end - 1])
            at = end
            continue
        if any(map(is_test, attributes)) and word not in ("pub", "("):  # skip what is for tests: up to `;` or the body's end
            module.left_out.add(words[at + 1] if word == "mod" else "")
            while at < len(words) and words[at] not in (";", "{"):
                at = closing(words, at) if words[at] in "([" else at + 1
            at = closing(words, at) if at < len(words) and words[at] == "{" else at + 1
            attributes = []
            continue
        if word == "mod" and at + 2 < len(words) and words[at + 2] in ";{" and words[at - 1 : at] != ["$"]:
            name = words[at + 1]
            if words[at + 2] == "{":
                end = closing(words, at + 2)
                child = module.children[name] = Module(module.file, module, name)
                read_module(child, words[at + 3 : end - 1], folder / name)
                at = end
            else:
                named = [a[2].strip('"') for a in attributes if a[:2] == ["path", "="]]
                places = [module.file.parent / n for n in named] + [folder / f"{name}.rs", folder / name / "mod.rs"]
                place = next((p for p in places if p.is_file()), None)
                if place:
                    child = module.children[name] = Module(place, module, name)
                    read_file(child, place.parent if place.name == "mod.rs" else place.parent / place.stem)
                at += 3
            attributes = []
            continue
        if word == "use" and (at == 0 or words[at - 1] not in ("::", "+", "->", ">")) and words[at + 1] != "<":
            found = []
            start = at + 1 + (words[at + 1] == "::")
            at = use_tree(words, start, [], found)
            for path, name in found:
                if name is None:
                    module.globs.append(path)
                else:
                    if name != "_" and depth == 0:
                        module.imports[name] = path
                    module.paths.append((path, True))
            attributes = []
            continue
        if word in ITEMS and at + 1 < len(words) and (at == 0 or words[at - 1] not in ("::", ".")):
            name = words[at + 2] if word == "macro_rules" else words[at + 1]
            if re.match(r"[A-Za-z_]", name) and depth == 0:
                module.items.add(name)
                if word in TYPES and (word != "union" or words[at + 2] in "{<"):
                    module.types.append(name)
        if re.match(r"[A-Za-z_]", word) and (at == 0 or words[at - 1] not in ("::", ".")):
            path = [word]
            while at + 2 < len(words) and words[at + 1] == "::" and re.match(r"[A-Za-z_]", words[at + 2]):
                path.append(words[at + 2])
                at += 2
            module.words.add(path[0])
            if len(path) > 1:
                module.paths.append((path, False))
        if word in "([{":
            depth += word == "{"
        elif word == "}":
            depth -= 1
        if word in (";", "}", "{"):
            attributes = []
        at += 1


def read_file(module, folder):
    """Reads a module from its file, and the modules that a macro there declares: files beside it that it names."""
    words = tokens(module.file.read_text())
    read_module(module, words, folder)
    if module.file.name in ("lib.rs", "mod.rs"):
        beside = {place.stem: place for place in folder.glob("*.rs")} | {p.parent.name: p for p in folder.glob("*/mod.rs")}
        for name, place in sorted(beside.items()):
            known = name in module.children or name in module.left_out or place == module.file or name in ("lib", "main")
            if not known and name in words:
                child = module.children[name] = Module(place, module, name)
                read_file(child, place.parent if place.name == "mod.rs" else place.parent / place.stem)


def resolve(module, path, seen=()):
    """The module in which the item of `path` stands, and whether the path ends in a module; None if outside the crate."""
    if (id(module), tuple(path)) in seen or len(seen) > 50:
        return None
    seen = (*seen, (id(module), tuple(path)))
    here, first = module, True
    for place, part in enumerate(path):
        last = place == len(path) - 1
        if part == "crate":
            here = here.root()
        elif part == "self":
            pass
        elif part == "super":
            here = here.parent or here
        elif part in here.items and (last or part not in here.children):
            return here, False
        elif part in here.imports and here.imports[part] != [part] and (last or part not in here.children):
            found = resolve(here, here.imports[part], seen)
            if found is None:
                return None if first else (here, False)
            if not found[1] or last:
                return found
            here = found[0]
        elif part in here.children:
            here = here.children[part]
        else:
            for glob in here.globs:
                source = resolve(here, glob, seen)
                if source and source[1] and source[0] is not here:
                    found = resolve(source[0], ["self", *path[place:]], seen)
                    if found and (found[1] or found[0] is not source[0] or path[place] in source[0].items):
                        return found
            return None if first else (here, False)
        first = False
    return here, True


def above(module):
    """The file of a module and those of the modules that it is in."""
    return {module.file} | (above(module.parent) if module.parent else set())


def arrows(root):
    """File -> files whose items it names, but for the modules that it is in."""
    graph = defaultdict(set)
    for module in root.all():
        ends = [resolve(module, path) for path, _ in module.paths]
        for glob in module.globs:
            source = resolve(module, glob)
            if source and source[1]:
                ends += [resolve(source[0], ["self", w]) for w in module.words if w in source[0].items | set(source[0].imports)]
        for end in ends:
            if end and not end[1] and end[0].file not in above(module):
                graph[module.file].add(end[0].file)
    return graph


def knots(graph):
    """Strongly connected sets of more than one file (Tarjan)."""
    order, low, stack, found = {}, {}, [], []

    def visit(node):
        order[node] = low[node] = len(order)
        stack.append(node)
        for other in sorted(graph[node]):
            if other not in order:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in stack:
                low[node] = min(low[node], order[other])
        if low[node] == order[node]:
            knot = set(stack[stack.index(node) :])
            del stack[stack.index(node) :]
            if len(knot) > 1:
                found.append(knot)

    for node in sorted(graph):
        if node not in order:
            visit(node)
    return found


def roots(folder):
    """The crates: every lib.rs and main.rs, programs, each with its modules."""
    for manifest in sorted([*folder.glob("crates/*/Cargo.toml"), *folder.glob("lab/Cargo.toml"), *folder.glob("fuzz/Cargo.toml")]):
        source = manifest.parent / "src"
        mains = [*source.glob("bin/*.rs"), *source.glob("bin/*/main.rs")]
        for file in [source / "lib.rs", source / "main.rs", *sorted(mains)]:
            if file.is_file():
                root = Module(file, None, manifest.parent.name)
                read_file(root, file.parent)
                yield root


def circles(folder):
    wrong, trees = [], list(roots(folder))
    for root in trees:
        graph = arrows(root)
        for knot in knots(graph):
            names = sorted(str(file.relative_to(folder)) for file in knot)
            wrong.append(f"{len(names)} files import each other:")
            for file in sorted(knot):
                others = ", ".join(str(o.relative_to(folder)) for o in sorted(graph[file] & knot))
                wrong.append(f"    {file.relative_to(folder)} -> {others}")
    count = sum(not line.startswith(" ") for line in wrong)
    return f"{count} import circles in {len(trees)} crates and programs", wrong


def lines(folder):
    wrong, files = [], [f for f in folder.glob("**/*.rs") if "target" not in f.relative_to(folder).parts]
    for file in sorted(files):
        count = file.read_text().count("\n")
        if count > LINES:
            wrong.append(f"{file.relative_to(folder)}: {count} lines, {LINES} at most")
    return f"{len(wrong)} of {len(files)} Rust files are over {LINES} lines", wrong


def names(folder):
    places = defaultdict(set)
    for root in roots(folder):
        if root.name == "lab":
            continue
        for module in root.all():
            for name in module.types:
                places[name].add(str(module.file.relative_to(folder)))
    double = {name: files for name, files in sorted(places.items()) if len(files) > 1}
    listed = [f"{name}: {', '.join(sorted(files))}" for name, files in double.items()]
    return f"{len(double)} names of types stand for two things, {NAMES} at most", listed if len(double) > NAMES else []


def readme(folder):
    wrong, text = [], (folder / "README.md").read_text()
    rows = text.splitlines()
    if len(rows) > README_LINES:
        wrong.append(f"README.md: {len(rows)} lines, {README_LINES} at most")
    for number, row in enumerate(rows, 1):
        if len(row) > README_WIDTH:
            wrong.append(f"README.md:{number}: {len(row)} characters, {README_WIDTH} at most")
    prose = re.sub(r"```.*?```|<!--.*?-->|<[^>]+>", "", text, flags=re.DOTALL)
    blocks, block = [], []
    for row in prose.splitlines():
        if not row.strip() or row.lstrip().startswith(("#", "|", "-", "*", ">")) or re.match(r"\s*\d+\. ", row):
            blocks.append(" ".join(block))
            block = [] if row.lstrip().startswith(("#", "|")) else [row.strip(" -*>")]
        else:
            block.append(row.strip())
    for block in [*blocks, " ".join(block)]:
        plain = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", re.sub(r"`[^`]*`", "code", block))
        for sentence in re.split(r"(?<=[.!?])\s+", plain):
            count = len(re.findall(r"[^\W_][\w'’.,-]*", sentence))
            if count > WORDS:
                wrong.append(f"README.md: {count} words, {WORDS} at most: {sentence[:90]} ...")
    return f"README.md has {len(rows)} lines", wrong


CHECKS = {"circles": circles, "lines": lines, "names": names, "readme": readme}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checks", nargs="*", metavar="CHECK", help=", ".join(CHECKS))
    parser.add_argument("--root", type=Path, default=Path(__file__).resolve().parent.parent)
    given = parser.parse_args()
    if unknown := set(given.checks) - set(CHECKS):
        parser.error(f"no check named {', '.join(sorted(unknown))}")
    failed = False
    for name in given.checks or CHECKS:
        summary, wrong = CHECKS[name](given.root.resolve())
        print(f"{name}: {summary}")
        print("".join(f"  {line}\n" for line in wrong), end="")
        failed |= bool(wrong)
    sys.exit(failed)


if __name__ == "__main__":
    main()
