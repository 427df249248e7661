"""Suites: named rows of snapshots with their scenes and truth, in an archive or a folder of JSON files."""

from __future__ import annotations

import json
import lzma
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from farm_ar.arrays import SHARE, Limits
from farm_ar.benchmark.worlds.base import Example, Row
from farm_ar.errors import OptionError, SnapshotError
from farm_ar.scenes import scene_from_dict, scene_to_dict, snapshot_from_dict, snapshot_to_dict
from farm_ar.scenes.documents import Document, Listing, Named, Object
from farm_ar.scenes.files import read_json, write_text
from farm_ar.scenes.kinds import Flag, Number, OrNull, Text

INDEX, TRUTH = "suite.json", "truth.json"
"""The files of a suite's folder that say what is in it, and what is true."""

DIGITS = 6
"""Digits of a position, counted from the first one of the scene's extent."""

SUITE = Document(
    "suite",
    Object(
        {
            "suite": Text(about="Its name, with its version."),
            "digest": Text(default=None, about="Hash of all scenes, snapshots and true labels."),
            "rows": Listing(
                Object(
                    {
                        "name": Text(),
                        "about": Text(default="tracks", about="What it is, in a few words."),
                        "all_in_view": Flag(default=False, about="Whether nothing can be out of view."),
                        "snapshots": Listing(
                            Text(),
                            least=1,
                            words="a list of at least one name",
                            about="Names: NAME.scene.json and NAME.snapshot.json are its files.",
                        ),
                    }
                ),
                least=1,
                different="name",
                words="a list of at least one row",
            ),
        },
        notes=True,
        about="Which snapshots there are, in rows.",
    ),
    OptionError,
)
"""What the index of a suite's folder holds."""

ANSWERS = Document(
    "answers",
    Object(
        {
            "suite": Text(about="The name of the suite, as its suite.json has it."),
            "method": Text(default="answers", about="What made the answers."),
            "answers": Named(
                Object(
                    {
                        "labels": Listing(
                            OrNull(Text(), "a label"),
                            about="For each detection, in the order of the snapshot file, its label or null.",
                        ),
                        "confidence": Listing(
                            Number(SHARE),
                            default=None,
                            about="For each detection the probability that its answer is right.",
                        ),
                        "seconds": Number(Limits(0.0, 1e9, ""), default=None, about="How long it took."),
                    }
                ),
                about="By the name of the snapshot, as in crossing/0001.",
            ),
        },
        notes=True,
        about="Which label each detection of each snapshot is. Also the form of truth.json.",
    ),
    OptionError,
)
"""What a file of answers holds, that of the truth among them."""

_KEY = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*/[A-Za-z0-9][A-Za-z0-9._-]*", re.ASCII)

_LINES = json.JSONEncoder(separators=(",", ":"), ensure_ascii=False, allow_nan=False)


@dataclass(frozen=True, eq=False)
class SuiteRow:
    """One row: snapshots of one kind, as the documents that its files hold.

    Args:
        name: its name.
        about: what it is, in a few words.
        all_in_view: whether nothing can be out of view.
        documents: of each snapshot its "scene" and "snapshot", as in files, and "truth", a list of labels.
    """

    name: str
    about: str
    all_in_view: bool
    documents: tuple[Mapping[str, Any], ...]

    def __len__(self) -> int:
        return len(self.documents)

    def key(self, index: int) -> str:
        """The name of one snapshot."""
        return f"{self.name}/{index:04d}"

    @cached_property
    def examples(self) -> tuple[Example, ...]:
        """The snapshots as records."""
        return tuple(self._example(i) for i in range(len(self)))

    def _example(self, index: int) -> Example:
        document, key = self.documents[index], self.key(index)
        scene = scene_from_dict(document["scene"], source=key)
        snapshot = snapshot_from_dict(document["snapshot"], source=key)
        return Example(scene, snapshot, _checked_truth(document["truth"], scene.layout.labels, snapshot, key))

    def first(self, number: int) -> SuiteRow:
        """The same row with at most so many of its snapshots."""
        return SuiteRow(self.name, self.about, self.all_in_view, self.documents[:number])


@dataclass(frozen=True, eq=False)
class Suite:
    """Rows of snapshots with the truth of each.

    Args:
        name: its name, with its version.
        rows: the rows, each with a name of its own.
        part_of: the hash of the whole suite, where this is a part of one.
    """

    name: str
    rows: tuple[SuiteRow, ...]
    part_of: str = ""

    @cached_property
    def digest(self) -> str:
        """Hash of all that is in the whole suite: 32 hexadecimal digits."""
        if self.part_of:
            return self.part_of
        whole = sha256()
        for line in self.lines():
            whole.update(line.encode() + b"\n")
        return whole.hexdigest()[:32]

    @cached_property
    def by_name(self) -> dict[str, SuiteRow]:
        """The rows by name."""
        return {row.name: row for row in self.rows}

    def lines(self) -> Iterator[str]:
        """The suite as lines of JSON: a heading for each row, and its snapshots below it."""
        for row in self.rows:
            yield _LINES.encode({"row": row.name, "about": row.about, "all_in_view": row.all_in_view})
            for document in row.documents:
                yield _LINES.encode(dict(document))

    def first(self, number: int) -> Suite:
        """The same with at most so many snapshots of each row."""
        return Suite(self.name, tuple(row.first(number) for row in self.rows), self.digest)

    def only(self, names: Sequence[str]) -> Suite:
        """The same with some of the rows.

        Args:
            names: of rows; with an asterisk at the end all that begin so.

        Raises:
            OptionError: there is no such row.
        """
        chosen = set[str]()
        for name in names:
            begin = name[:-1] if name.endswith("*") else None
            found = {one for one in self.by_name if one == name or (begin and one.startswith(begin))}
            if not found:
                known = ", ".join(self.by_name)
                raise OptionError("--rows", f"must be one or several of {known}", name)
            chosen |= found
        return Suite(self.name, tuple(row for row in self.rows if row.name in chosen), self.digest)


def made_examples(row: Row, seed: int, count: int) -> list[Example]:
    """Examples of a simulated world, a function of the seed, their number and the row's name."""
    name = int.from_bytes(sha256(row.name.encode()).digest()[:4], "big")
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(name,)))
    return row.make(rng, count)


def row_of(name: str, about: str, all_in_view: bool, examples: Iterable[Example]) -> SuiteRow:
    """A row of examples, their numbers rounded to what files need."""
    return SuiteRow(name, about, all_in_view, tuple(_document(example) for example in examples))


def _document(example: Example) -> dict[str, Any]:
    scene, snapshot, truth = example
    places = np.concatenate([scene.layout.position, snapshot.detections.position])
    extent = float(np.ptp(places, axis=0).max()) if len(places) else 1.0
    decimals = max(DIGITS - int(np.ceil(np.log10(max(extent, 1e-9)))), 0)
    return {
        "scene": _rounded(scene_to_dict(scene), decimals),
        "snapshot": _rounded(snapshot_to_dict(snapshot), decimals),
        "truth": list(truth),
    }


def _rounded(value: Any, decimals: int, name: str = "") -> Any:
    """A document with its angles to a thousandth of a degree, its lengths to some decimals."""
    if isinstance(value, dict):
        return {key: _rounded(item, decimals, key) for key, item in value.items()}
    if isinstance(value, list):
        return [_rounded(item, decimals, name) for item in value]
    if isinstance(value, float):
        short = round(value, 3 if name.endswith("_deg") else decimals)
        return int(short) if short.is_integer() and abs(short) < 2**53 else short
    return value


def pack(suite: Suite, path: str | os.PathLike[str]) -> None:
    """Write a suite as an archive: its lines, compressed with xz."""
    text = "".join(line + "\n" for line in suite.lines())
    Path(path).write_bytes(lzma.compress(text.encode(), preset=9 | lzma.PRESET_EXTREME))


def unpack(name: str, data: bytes) -> Suite:
    """The suite of an archive that `pack` has written."""
    rows: list[tuple[dict[str, Any], list[dict[str, Any]]]] = []
    for line in lzma.decompress(data).decode().splitlines():
        document = json.loads(line)
        if "row" in document:
            rows.append((document, []))
        else:
            rows[-1][1].append(document)
    return Suite(
        name,
        tuple(SuiteRow(h["row"], h["about"], h["all_in_view"], tuple(documents)) for h, documents in rows),
    )


def write_folder(suite: Suite, folder: str | os.PathLike[str], truth: bool) -> int:
    """Write a suite as a folder of scene and snapshot files; the number of its snapshots.

    Args:
        suite: what to write.
        folder: where; made if need be.
        truth: whether `truth.json` is written, too.
    """
    out, answers, rows = Path(folder), {}, []
    for row in suite.rows:
        rows.append(
            {
                "name": row.name,
                "about": row.about,
                "all_in_view": row.all_in_view,
                "snapshots": [row.key(i) for i in range(len(row))],
            }
        )
        for i, document in enumerate(row.documents):
            for part in ("scene", "snapshot"):
                write_text(out / f"{row.key(i)}.{part}.json", json.dumps(document[part], indent=1) + "\n")
            answers[row.key(i)] = {"labels": document["truth"]}
    index = {"suite": suite.name, "digest": suite.digest, "rows": rows}
    write_text(out / INDEX, json.dumps(index, indent=1) + "\n")
    if truth:
        write_text(out / TRUTH, json.dumps({"suite": suite.name, "answers": answers}, indent=1) + "\n")
    return len(answers)


def read_folder(folder: str | os.PathLike[str]) -> Suite:
    """The suite of a folder with its truth, as `farm-ar convert` writes it.

    Raises:
        OptionError: it is no folder, or a file of it is missing or not of its form.
        SnapshotError: a file of a scene or a snapshot is missing or not JSON.
    """
    place = Path(folder)
    if not (place / INDEX).is_file() or not (place / TRUTH).is_file():
        raise OptionError("--data", f"must be a folder with {INDEX} and {TRUTH}", str(place))
    index = SUITE.read(read_json(place / INDEX, OptionError), INDEX)
    truth = ANSWERS.read(read_json(place / TRUTH, OptionError), TRUTH)["answers"]
    rows = []
    for row in index["rows"]:
        documents = []
        for key in row["snapshots"]:
            if not _KEY.fullmatch(key):
                raise OptionError("snapshots", "must be names as in crossing/0001", key, INDEX)
            if key not in truth:
                raise OptionError(f"answers.{key}", f"must be there, for {INDEX} names it", "nothing", TRUTH)
            files = {part: place / f"{key}.{part}.json" for part in ("scene", "snapshot")}
            parts = {part: read_json(file, SnapshotError) for part, file in files.items()}
            documents.append({**parts, "truth": truth[key]["labels"]})
        rows.append(SuiteRow(row["name"], row["about"], row["all_in_view"], tuple(documents)))
    return Suite(index["suite"], tuple(rows))


def _checked_truth(truth: object, labels: Sequence[str], snapshot: Any, key: str) -> tuple[str | None, ...]:
    """The truth of a snapshot, if it is one.

    Raises:
        SnapshotError: it has not a label of the scene, or None, for each detection.
    """
    number = len(snapshot.detections)
    if not isinstance(truth, list) or len(truth) != number:
        expected = f"must be a list with a label or null for each of {number} detections"
        raise SnapshotError("truth", expected, truth, key)
    for label in truth:
        if label is not None and label not in labels:
            raise SnapshotError("truth", "must be labels of the scene, or null", label, key)
    return tuple(truth)
