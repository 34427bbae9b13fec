#!/usr/bin/env python3
"""Checks what mdBook does not: links, quoted numbers, the length of records, figures without a command.

    python3 scripts/check-book.py           # fails with a list of what is wrong
    python3 scripts/check-book.py --fill    # writes the numbers that are quoted by their key

A sentence quotes a number as `<!-- n:KEY -->1.76<!-- / -->`. The key stands in one of book/src/generated/*.json, flat objects
of strings, which the programs that make the tables write. README's table is made of such numbers between `<!-- t:readme -->`
and `<!-- / -->`; a cell without a number is a dot, and fails the check.
"""

import json
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
BOOK = ROOT / "book" / "src"
RECORD_LINES = 20  # of a record of an experiment, without the empty ones
TABLE = re.compile(r"(<!-- t:readme -->\n)(.*?)(<!-- / -->)", re.S)
ROWS = [  # of README's table: key and words
    ("objects", "objects, clean"),
    ("corrupted", "objects, 12 corruptions"),
    ("partial", "objects seen in part"),
    ("scans", "real scans"),
    ("meshes", "other meshes"),
]
QUOTE = re.compile(r"(<!-- n:([\w.+-]+) -->)(.*?)(<!-- / -->)", re.S)
LINK = re.compile(r"!?\[[^\]]*\]\(([^()\s]+)\)")
NO_COMMAND = re.compile(r"scripts? (?:that (?:is|are) )?(?:outside|not in) the repository|scratch program")


def documents():
    pages = sorted(BOOK.rglob("*.md"))
    cards = sorted((ROOT / "crates").glob("*/weights/**/*.md"))
    return pages, [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")] + cards


def without_code(text):
    text = re.sub(r"^(```|~~~).*?^\1", "", text, flags=re.S | re.M)
    return re.sub(r"`[^`\n]*`", "", text)


def anchors(path):
    """The anchors that mdBook and GitHub give to the headings of a page."""
    found = set()
    for heading in re.findall(r"^#+ (.+)$", re.sub(r"^```.*?^```", "", path.read_text(), flags=re.S | re.M), re.M):
        name = re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-")
        while name in found:
            name += "-1"
        found.add(name)
    return found


def check_links(path, text):
    for target in LINK.findall(without_code(text)):
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        file = (path.parent / name).resolve() if name else path
        if not file.exists():
            yield f"link to {target}: no such file"
        elif anchor and file.suffix == ".md" and anchor not in anchors(file):
            yield f"link to {target}: no such heading"
        elif BOOK in path.parents and BOOK not in file.parents:
            yield f"link to {target}: outside the book"


def check_summary(pages):
    text = (BOOK / "SUMMARY.md").read_text()
    listed = {(BOOK / name).resolve() for name in LINK.findall(text)}
    for page in pages:
        if page.name != "SUMMARY.md" and page not in listed:
            yield f"{page.relative_to(ROOT)}: not in SUMMARY.md"


def check_records(path, text):
    if path.parent.name != "experiments" or path.name == "index.md":
        return
    for record in re.split(r"^## ", text, flags=re.M)[1:]:
        title, *lines = record.split("\n")
        count = sum(1 for line in lines if line.strip())
        if count > RECORD_LINES:
            yield f"record `{title}` has {count} lines; at most {RECORD_LINES}"
        for part in ("Question", "Tried", "Result", "Choice", "Command"):
            if f"**{part}.**" not in record:
                yield f"record `{title}` has no {part.lower()}"


def numbers():
    found, problems = {}, []
    for file in sorted((BOOK / "generated").glob("*.json")):
        for key, value in json.loads(file.read_text()).items():
            if key in found:
                problems.append(f"{file.relative_to(ROOT)}: the key {key} stands in another file, too")
            found[key] = str(value)
    return found, problems


def cell(value, column):
    """Shares as whole numbers, seconds with one decimal."""
    try:
        return f"{float(value):.{1 if column.endswith('seconds') else 0}f}"
    except ValueError:
        return value


def readme_table(known):
    head = "| pairs | right, % | of the answered right, % | s a pair | best peer | its right, % | its s |"
    columns = ("right", "right_answered", "seconds", "peer", "peer_right", "peer_seconds")
    lines = [head, "|---|---|---|---|---|---|---|"]
    for row, words in ROWS:
        lines.append(f"| {words} | " + " | ".join(cell(known.get(f"readme.{row}.{c}", "not kept" if c.endswith("seconds") else "·"), c) for c in columns) + " |")
    return "\n".join(lines) + "\n"


def main():
    fill = sys.argv[1:] == ["--fill"]
    if sys.argv[1:] and not fill:
        sys.exit(__doc__)
    pages, others = documents()
    known, problems = numbers()
    problems += check_summary(pages)
    for path in pages + [p for p in others if p.exists()]:
        text = path.read_text()
        here = list(check_links(path, text)) + list(check_records(path, text))
        if NO_COMMAND.search(text):
            here.append("a figure of a script that is not in the repository")
        for _, key, value, _ in QUOTE.findall(text):
            if key not in known:
                here.append(f"number {key}: no program has written it")
            elif not fill and known[key] != value:
                here.append(f"number {key} is {known[key]}, and the sentence says {value}")
        table = TABLE.search(text)
        if table:
            made = readme_table(known)
            if "·" in made:
                here.append("the table has cells without a number")
            if not fill and made != table[2]:
                here.append("the table is not the one that --fill makes")
        if fill:
            text = path.read_text()
            filled = TABLE.sub(lambda m: m[1] + readme_table(known) + m[3], text)
            filled = QUOTE.sub(lambda m: m[1] + known.get(m[2], m[3]) + m[4], filled)
            if filled != text:
                path.write_text(filled)
        problems += [f"{path.relative_to(ROOT)}: {what}" for what in here]
    if problems:
        sys.exit("\n".join(problems))


if __name__ == "__main__":
    main()
