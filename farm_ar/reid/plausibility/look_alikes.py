"""Names that people, or different systems, take for one another: look-alike characters, blanks, capitals."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Sequence

from farm_ar.reid.plausibility.finding import Finding
from farm_ar.reid.plausibility.kept import kept
from farm_ar.scenes import Layout

_CYRILLIC = dict(zip("асеорхујіѕԁһԛԝкмтАВСЕНІЈКМОРЅТХУ", "aceopxyjisdhqwkmtABCEHIJKMOPSTXY", strict=True))
_GREEK = dict(zip("οαινρυχκτΑΒΕΖΗΙΚΜΝΟΡΤΥΧϲ", "oaivpuxktABEZHIKMNOPTYXc", strict=True))
_LOOKS = str.maketrans(_CYRILLIC | _GREEK | dict(zip("ıɑɡ’‐–—−", "iag'----", strict=True)))
_DIGITS = str.maketrans({"0": "O", "1": "l", "I": "l", "|": "l"})
_UNSEEN = ("Cc", "Cf", "Zs", "Zl", "Zp")
"""Characters that leave no mark: of control, of format, blanks."""


def looks(name: str) -> tuple[str, str]:
    """What is left of a name once what is hard to see is gone; names that share either look alike.

    Returns:
        Without regard to capitals; and with regard to them, but not to O and 0, or I, l and 1.
    """
    plain = unicodedata.normalize("NFKC", name).translate(_LOOKS)
    plain = "".join(sign for sign in plain if unicodedata.category(sign) not in _UNSEEN)
    return plain.casefold(), plain.translate(_DIGITS)


def alike(names: Sequence[str]) -> list[tuple[str, ...]]:
    """Groups of different names that look alike, each in the order given."""
    groups: dict[tuple[int, str], list[str]] = {}
    for name in dict.fromkeys(names):
        same = {id(group): group for look in enumerate(looks(name)) for group in [groups.get(look)] if group}
        joined = [*(other for group in same.values() for other in group), name]
        for other in joined:
            groups |= dict.fromkeys(enumerate(looks(other)), joined)
    distinct = {id(group): tuple(group) for group in groups.values() if len(group) > 1}
    return list(distinct.values())


def look_alike(name: str, others: Iterable[str]) -> str | None:
    """The first of some other names that a name looks like."""
    mine = looks(name)
    for other in others:
        if other != name and any(a == b for a, b in zip(mine, looks(other), strict=True)):
            return other
    return None


@kept
def check_names(layout: Layout) -> tuple[Finding, ...]:
    """Labels, and categories, of a scene that are hard to tell apart."""
    found = []
    for what, names in (("labels", layout.labels), ("categories", layout.categories)):
        groups = alike(names)
        if groups:
            shown = "; ".join(" and ".join(ascii(name) for name in group) for group in groups[:3])
            more = f" and {len(groups) - 3} more groups" if len(groups) > 3 else ""
            said = f"{what} that differ only in look-alike characters, capitals or blanks: {shown}{more}"
            todo = "give different things names that differ visibly"
            found.append(Finding("look-alikes", f"{said}; {todo}"))
    return tuple(found)
