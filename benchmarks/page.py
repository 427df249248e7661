"""All measurements of speed, one after another, as one page: docs/speed.md.

    python benchmarks/page.py [PART ...]

Each part is a script of this folder, which says what it measures; all are run by default, in about half an
hour. With some named, the page holds these only, and is printed, not written.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

PARTS = {
    "identification": ("", []),
    "service": ("The service", []),
    "environments": ("Environments", []),
    "rendering": ("Pictures", []),
    "sweeps": ("Sweeps", []),
}
"""Scripts by name: the title of each one's part of the page, and its arguments."""

FOLDER = Path(__file__).parent
PAGE = FOLDER.parent / "docs" / "speed.md"


def measured(name: str) -> str:
    """What a script prints, a section of the page; shown on the way.

    Raises:
        SystemExit: the script fails.
    """
    title, arguments = PARTS[name]
    command = [sys.executable, str(FOLDER / f"{name}.py"), *arguments]
    lines = []
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            print(line, end="", flush=True)
            lines.append(line)
    if process.returncode:
        raise SystemExit(f"{name}.py failed; no page is written")
    text = "".join(lines).strip()
    if not title:
        return text
    if "|" not in text:  # no table of Markdown
        text = f"```\n{text}\n```"
    text = re.sub(r"^# .*\n+", "", text)
    return f"## {title} (`python benchmarks/{name}.py`)\n\n" + re.sub(r"^##", "###", text, flags=re.MULTILINE)


def main() -> None:
    """Measure, and write the page whole."""
    names = sys.argv[1:] or list(PARTS)
    unknown = sorted(set(names) - set(PARTS))
    if unknown:
        raise SystemExit(f"{', '.join(unknown)}: must be of {', '.join(PARTS)}")
    text = "\n\n".join(measured(name) for name in names)
    text = text.replace("`python benchmarks/identification.py --write`", "`make bench`", 1)
    if not sys.argv[1:]:
        unfinished = PAGE.with_suffix(".md.part")
        unfinished.write_text(text + "\n", encoding="utf-8")
        unfinished.replace(PAGE)


if __name__ == "__main__":
    main()
