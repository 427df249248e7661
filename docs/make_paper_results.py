"""Puts the summaries of `farm-ar reproduce ... --out DIR` into paper-results.md, and the pictures beside it.

Run it after the commands that the page names: python docs/make_paper_results.py AUTHORS OWN, folders with one
`reproduce all` each (or folders of single experiments in them): of the authors' layouts, and of ours.
"""

import re
import shutil
import sys
from pathlib import Path

PAGE = Path(__file__).parent / "paper-results.md"
SYNTHETIC = ("Table 1", "Table 2", "Table 3", "Fig. 5", "Fig. 7", "Fig. 9")
REAL = ("Table 4", "Table 5", "Fig. 13", "Fig. 14")
PICTURES = ("table1", "table3", "table4", "table5", "fig5", "fig7", "fig9", "fig13", "fig14")


def sections(folder: Path) -> dict[str, str]:
    """The sections of all summaries in a folder, by the table or figure that their titles begin with."""
    found = {}
    for path in sorted(folder.rglob("summary.md")):
        for part in path.read_text(encoding="utf-8").split("\n## ")[1:]:
            title, _, body = part.partition("\n")
            body = re.sub(r"\n*Picture: .*\n*$", "", body.strip())
            found[title.partition(":")[0]] = f"### {title}\n\n{body}\n"
    return found


def main() -> None:
    """Rewrite what stands between the marks."""
    authors, own = map(Path, sys.argv[1:3])
    page = PAGE.read_text(encoding="utf-8")
    for mark, folder, names in (
        ("authors", authors, SYNTHETIC),
        ("real", own, REAL),
        ("own", own, SYNTHETIC),
    ):
        text = "\n".join(sections(folder)[name] for name in names)
        begin, end = f"<!-- {mark}: begin -->", f"<!-- {mark}: end -->"
        before, _, rest = page.partition(begin)
        _, _, after = rest.partition(end)
        page = f"{before}{begin}\n\n{text}\n{end}{after}"
    PAGE.write_text(page, encoding="utf-8")
    for name in PICTURES:
        for path in own.rglob(f"{name}.svg"):
            shutil.copy(path, PAGE.parent / "images" / path.name)
    print(f"Wrote {PAGE}")


if __name__ == "__main__":
    main()
