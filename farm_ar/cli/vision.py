"""`farm-ar vision`: estimators of poses from images, judged and trained."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from farm_ar.cli.output import Report
    from farm_ar.vision.scoring import Frame

app = typer.Typer(help="Poses from images: judge what estimates them.", no_args_is_help=True)


@app.command("benchmark")
def vision_benchmark(
    frames: Annotated[
        list[Path], typer.Argument(metavar="FOLDER...", help="Folders with frames and their truth.")
    ],
    estimator: Annotated[
        str, typer.Option(metavar="NAME", help="network, or module:Class of your own.")
    ] = "network",
    meshes: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Meshes by category; the farm's by default.")
    ] = None,
    count: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Frames of each folder; all by default.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")] = False,
) -> None:
    """Judge an estimator on frames with truth, a table a folder.

    Missed: no estimate of its category within 5 cm. False: an estimate of what does not stand there.
    Time is that of one processor.
    """
    import cv2

    from farm_ar.cli.output import print_json, print_line, print_table, progress
    from farm_ar.scenes.files import json_values
    from farm_ar.vision.photos import categories_in
    from farm_ar.vision.registry import load_estimator
    from farm_ar.vision.scoring import COLUMNS, evaluate, farm_meshes, frame_files, table_rows

    cv2.setNumThreads(1)
    judged, answers = load_estimator(estimator), {}
    for folder in frames:
        files = frame_files(folder, count)
        things = farm_meshes() if meshes is None else categories_in(meshes)
        with progress(f"Judging {estimator} on {len(files)} frames of {folder.name}") as report:
            found, _ = evaluate(judged, _read(files, report), things)
        if as_json:
            answers[str(folder)] = {
                **{name: row._asdict() for name, row in found.rows.items()},
                "false": found.false,
                "frames": found.frames,
                "image_ms": found.image_ms,
                "estimate_ms": found.thing_ms,
            }
            continue
        print_line(f"{folder}: {found.frames} frames, {estimator}")
        print_table(COLUMNS, table_rows(found), COLUMNS[1:])
        print_line(f"{found.image_ms:.0f} ms an image and {found.thing_ms:.0f} ms an estimate")
    if as_json:
        print_json(json_values(answers))


def _read(files: Sequence[Path], report: Report) -> Iterator[Frame]:
    """Frames, with how far the work is."""
    from farm_ar.vision.scoring import read_frame

    for number, file in enumerate(files):
        report(f"{number} of {len(files)} frames", number / len(files))
        yield read_frame(file)
