"""Checks that every relative link in the Markdown files leads to a file, and to a heading of it."""

import re
import subprocess
import sys
import unicodedata
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LINK = re.compile(r"(?<!!)\[[^\]]*\]\(([^)\s]+)(?:\s+\"[^\"]*\")?\)|!\[[^\]]*\]\(([^)\s]+)\)")
FENCE = re.compile(r"^(```|~~~).*?^\1", re.M | re.S)


def documents():
    """Markdown files that are, or are about to be, under version control."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "*.md"]
    listed = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    return [ROOT / line for line in listed.splitlines() if (ROOT / line).exists()]


def prose(document):
    return FENCE.sub("", document.read_text(encoding="utf-8"))


def anchor(heading):
    """The name under which a heading can be linked to."""
    text = re.sub(r"[`*]|\[([^\]]*)\]\([^)]*\)", r"\1", heading).strip().lower()
    kept = (c for c in text if c in "-_ " or unicodedata.category(c)[0] in "LN")
    return "".join(kept).replace(" ", "-")


def anchors(document):
    return {anchor(line) for line in re.findall(r"^#{1,6}\s+(.+?)\s*#*$", prose(document), re.M)}


def problem(document, link):
    if re.match(r"[a-z][a-z0-9+.-]*:", link):
        return None
    path, _, fragment = link.partition("#")
    target = (document.parent / path).resolve() if path else document
    if not target.exists():
        return "no such file"
    if fragment and target.suffix == ".md" and fragment not in anchors(target):
        return "no such heading"
    return None


def main():
    checked = 0
    problems = []
    for document in documents():
        for match in LINK.finditer(prose(document)):
            link = match[1] or match[2]
            checked += 1
            if found := problem(document, link):
                problems.append(f"{document.relative_to(ROOT)}: {link}: {found}")
    print(f"{checked} links checked")
    sys.exit("\n".join(problems) if problems else 0)


if __name__ == "__main__":
    main()
