"""Checks that the documents agree with the tree. No argument.

Every relative link, with its anchor, and every path between backticks exists; every test that tests/README.md names
exists; README.md has at most 150 lines, and prose at most 120 columns. Exit status 1 if not.
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SKIPPED_FOLDERS = {".git", "build", "node_modules"}
SOURCES = "h|cpp|ts|mjs|py|fbs|md|svg|yaml|cfg"
README_LINES = 150
COLUMNS = 120

# Between backticks, looking like paths, and in no folder of this project.
NO_PATHS = {
    "build/release/bin": "output of a build",
    "build/release/python": "output of a build",
    "http/1.1": "a protocol",
}


def files():
    """Every file of the project, relative to the root."""
    found = []
    for path in ROOT.rglob("*"):
        relative = path.relative_to(ROOT)
        if path.is_file() and not SKIPPED_FOLDERS.intersection(relative.parts):
            found.append(relative.as_posix())
    return found


def without_blocks(text):
    """The text with the lines of fenced blocks empty."""
    lines, inside = [], False
    for line in text.splitlines():
        fence = line.startswith("```")
        lines.append("" if inside or fence else line)
        inside ^= fence
    return lines


def anchors_of(path):
    """As GitHub makes them from headings."""
    headings = [line.lstrip("#").strip() for line in without_blocks(path.read_text(encoding="utf-8")) if line[:1] == "#"]
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def check_links(document, line):
    for target in re.findall(r"\]\(([^)\s]+)\)", line):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        file = (document.parent / path).resolve() if path else document
        if not file.exists():
            yield f"the link {target} leads nowhere"
        elif anchor and anchor not in anchors_of(file):
            yield f"{target}: there is no such heading"


def check_paths(document, line, names):
    for text in re.findall(r"`([^`\s]+)`", line):
        if text in NO_PATHS or not re.fullmatch(r"[\w./*-]+", text) or text.startswith(("/", ".", "-")):
            continue
        has_folder, is_source = "/" in text.rstrip("/"), re.search(rf"\.({SOURCES})$", text)
        if not has_folder and not is_source and not text.endswith("/"):
            continue
        if re.fullmatch(r"[A-Z]\w+/[A-Z]\w+\..*", text):
            continue  # a test
        if has_folder or text.endswith("/"):
            exists = any(any(folder.glob(text.rstrip("/"))) for folder in (ROOT, document.parent))
        else:
            exists = text in names
        if not exists:
            yield f"the path {text} does not exist"


def check_tests(line, sources):
    for name in re.findall(r"`([A-Z][\w/]*\.[A-Z][\w/*]*)`", line):
        suite, case = re.sub(r"^\w+/", "", name).removesuffix("/*").split(".")
        if not re.search(rf"TEST\w*\(\s*{suite},\s*{case}\s*\)|NAME {suite}\.{case}\b", sources):
            yield f"there is no test {name}"


def check_shape(document, lines):
    if document == ROOT / "README.md" and len(lines) > README_LINES:
        yield f"{len(lines)} lines, and at most {README_LINES} are wanted"
    for number, line in enumerate(without_blocks("\n".join(lines)), 1):
        if len(line) > COLUMNS and not line.startswith(("|", "![")):
            yield f"line {number} has {len(line)} columns, and at most {COLUMNS} are wanted"


def main():
    tree = files()
    names = {Path(path).name for path in tree}
    tests = "\n".join((ROOT / path).read_text(encoding="utf-8") for path in tree
                      if path.startswith("tests/") and path.endswith(("_test.cpp", "CMakeLists.txt")))
    troubles = []
    for path in sorted(path for path in tree if path.endswith(".md")):
        document = ROOT / path
        text = document.read_text(encoding="utf-8")
        troubles += [f"{path}: {trouble}" for trouble in check_shape(document, text.splitlines())]
        for number, line in enumerate(without_blocks(text), 1):
            found = [*check_links(document, line), *check_paths(document, line, names)]
            if path == "tests/README.md":
                found += check_tests(line, tests)
            troubles += [f"{path}:{number}: {trouble}" for trouble in found]
    for trouble in troubles:
        print(trouble, file=sys.stderr)
    sys.exit(1 if troubles else 0)


if __name__ == "__main__":
    main()
