"""`farm-ar identify`: which detection is which label, for a scene and a snapshot of the user's own."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from farm_ar.cli.options import DEFAULT_REID, REID_HELP, number

if TYPE_CHECKING:
    from farm_ar.reid import Reidentifier
    from farm_ar.scenes import Scene, Snapshot


def identify(
    scene: Annotated[
        str,
        typer.Option(
            metavar="FILE|NAME",
            help="The reference layout: .json, .csv with --room, or a built-in scene's name.",
        ),
    ],
    snapshot: Annotated[
        Path,
        typer.Option(
            metavar="FILE|-",
            help="The snapshot: .json, or .csv with --camera; - reads standard input, one or many as JSON.",
        ),
    ],
    room: Annotated[
        str | None,
        typer.Option(metavar="W,D", help="Width and depth of the room in metres; for a scene in CSV only."),
    ] = None,
    camera: Annotated[
        str | None,
        typer.Option(metavar="X,Z,YAW_DEG,FOV_DEG,RANGE_M", help="The camera; for a snapshot in CSV only."),
    ] = None,
    frame: Annotated[
        str,
        typer.Option(
            metavar="FRAME",
            help="The snapshot's: map, the scene's own, or unknown, to be found by what stands where.",
        ),
    ] = "map",
    reid: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help=f"{DEFAULT_REID} by default, spatial with an option that belongs to it. Names: {REID_HELP}",
        ),
    ] = None,
    threshold: Annotated[
        float | None,
        typer.Option(
            metavar="T",
            parser=number(),
            help="Sites to consider: 0 for the camera's own only, to 1, the default, for all. (*)",
        ),
    ] = None,
    weights: Annotated[
        str | None,
        typer.Option(metavar="WT,WR", help="Of translation and rotation; the scene's own by default. (*)"),
    ] = None,
    gate: Annotated[
        bool | None,
        typer.Option(
            "--gate/--no-gate",
            help="Whether labels keep to detections of their category, as by default. "
            "(*, distance, squared-distance, nearest)",
        ),
    ] = None,
    solver: Annotated[str | None, typer.Option(metavar="NAME", help="lsap, the default, or mip. (*)")] = None,
    min_confidence: Annotated[
        float | None,
        typer.Option(
            metavar="P",
            parser=number(),
            help="Give no label that is less probable; 0 by default. adaptive and likelihood only.",
        ),
    ] = None,
    confusion: Annotated[
        float | None,
        typer.Option(
            metavar="P",
            parser=number(),
            help="How often a category is wrong; 0, the default, keeps it. adaptive and likelihood only.",
        ),
    ] = None,
    explain: Annotated[
        str | None,
        typer.Option(
            metavar="ID", help="Explain why this detection has its label. spatial and likelihood only."
        ),
    ] = None,
    plot: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the answer, .svg or .png.")] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the answer as JSON and nothing else.")
    ] = False,
) -> None:
    """Identify the detections of a snapshot.

    Warnings, on the error stream and in the JSON, say what cannot be right.

    A CSV table has the columns id, category, x, z, yaw_deg, w, h, d, in metres and degrees.
    Snapshots on standard input are answered one by one, with --json in a line each; a bad one is answered by
    an error, and the exit code is 2 at the end.
    Options marked (*) belong to the method spatial, which is used where no other is named with them, and for
    very many objects.
    """
    from farm_ar.cli.inputs import Choices, make_rule, read_scene, read_snapshot, refuse
    from farm_ar.reid.registry import MOST_PAIRS

    known = read_scene(scene, room)
    by_default = reid is None
    if reid is None:
        of_spatial = any(option is not None for option in (threshold, weights, gate, solver, explain))
        reid = "spatial" if of_spatial else DEFAULT_REID
    asked = Asked(known, reid, explain, plot, as_json, frame)
    choices = Choices(threshold, weights, gate, solver, min_confidence, confusion)
    if str(snapshot) == "-":
        refuse([("--camera", camera), ("--plot", plot)], "with --snapshot -")
        _answer_stream(asked, make_rule(known, reid, choices))
        return
    seen = read_snapshot(snapshot, camera)
    if by_default and len(known.layout) * len(seen.detections) > MOST_PAIRS[DEFAULT_REID]:
        reid = "spatial"
        asked = asked._replace(reid=reid)
    _answer(asked, make_rule(known, reid, choices), seen)


class Asked(NamedTuple):
    """What is asked for: the scene, the method's name, and what is shown of an answer, and how."""

    scene: Scene
    reid: str
    explain: str | None
    plot: Path | None
    as_json: bool
    frame: str
    line: bool = False
    """Whether JSON is printed in one line."""


def _answer_stream(asked: Asked, rule: Reidentifier) -> None:
    """Answer the snapshots on standard input, each as soon as it is there."""
    import json
    import sys

    from farm_ar.errors import InputError, escaped
    from farm_ar.scenes import read_snapshots

    asked, mistakes = asked._replace(line=True), 0
    for seen in read_snapshots(sys.stdin.buffer):
        try:
            if isinstance(seen, InputError):
                raise seen
            _answer(asked, rule, seen)
        except InputError as problem:
            mistakes += 1
            said = escaped(f"{type(problem).__name__}: {problem}")
            if asked.as_json:
                print(json.dumps({"error": said}))
            else:
                typer.echo(said, err=True)
        sys.stdout.flush()
    if mistakes:
        raise typer.Exit(2)


def _answer(asked: Asked, rule: Reidentifier, seen: Snapshot) -> None:
    """Identify the detections of a snapshot, and print and draw what is asked for."""
    from farm_ar.cli import output, reports
    from farm_ar.cli.inputs import check_size, decided_by_category, explanation
    from farm_ar.reid import align
    from farm_ar.reid import identify as checked_identify

    known, reid, explain, plot, as_json, frame, line = asked
    check_size(reid, len(known.layout), len(seen.detections))
    found = checked_identify(known, seen, reports.Affordable(rule, known), frame)
    if frame == "unknown":
        alignment = align(known, seen)
        seen = alignment.apply(seen)
    why = None if explain is None else explanation(rule, seen, explain)
    if plot is not None:
        from farm_ar.cli.reports import picture_of_identification

        picture_of_identification(known, seen, found, plot)
    for warning in found.warnings:
        typer.echo(f"Warning: {output.printable(warning)}", err=True)
    if as_json:
        values = {"method": reid} | reports.as_values(seen, found)
        values |= {} if why is None else {"explanation": why}
        values |= reports.frame_values(alignment) if frame == "unknown" else {}
        output.print_json(values, line)
        return
    output.print_line(f"Method: {reid}")
    output.print_table(
        reports.DETECTION_COLUMNS, reports.detection_rows(seen, found), reports.DETECTION_NUMBERS
    )
    if frame == "unknown":
        output.print_line(reports.frame_line(alignment))
    for words in reports.summarise(known, seen, found):
        output.print_line(words)
    if decided := decided_by_category(rule, seen, found):
        which = f"{len(decided)} of {len(seen.detections)} detections ({reports.some(decided)})"
        output.print_line(f"Categories decided the labels of {which}: with --no-gate they would be others")
    if why is not None:
        output.print_line(why)
    if plot is not None:
        output.print_line(f"Wrote {plot}")
