"""`farm-ar identify`: which detection is which label, for a scene and a snapshot of the user's own."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from farm_ar.cli.options import DEFAULT_REID, REID_HELP, AsJson, Plot, number

if TYPE_CHECKING:
    from farm_ar.cli.from_image import Photo
    from farm_ar.cli.inputs import Choices
    from farm_ar.reid import Reidentifier
    from farm_ar.reid.alignment import Pose
    from farm_ar.reid.checked import InFrame
    from farm_ar.scenes import Scene, Snapshot

SceneName = Annotated[
    str,
    typer.Option(
        metavar="FILE|NAME", help="The reference layout: .json, .csv with --room, or a built-in scene's name."
    ),
]
SnapshotFile = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE|-",
        help="The snapshot: .json, or .csv with --camera; - reads one or many as JSON from standard input.",
    ),
]
Room = Annotated[
    str | None,
    typer.Option(metavar="W,D", help="Width and depth of the room in metres; for a scene in CSV only."),
]
CameraView = Annotated[
    str | None,
    typer.Option(
        metavar="X,Z,YAW_DEG,FOV_DEG,RANGE_M|FILE",
        help="The camera, in the table's frame and units (the range in metres), for a snapshot in CSV; or a "
        ".json file with an image's.",
    ),
]
ImageFile = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Instead of a snapshot: a .png or .jpg, with --camera and --meshes."),
]
Meshes = Annotated[
    Path | None,
    typer.Option(
        metavar="FOLDER", help="With --image: folder with a mesh for each category, named after it."
    ),
]
Estimator = Annotated[
    str,
    typer.Option(metavar="NAME", help="With --image, estimates poses: network, or module:Class of your own."),
]
Frame = Annotated[
    str,
    typer.Option(
        metavar="FRAME",
        help="The snapshot's frame: map (the scene's), or unknown: estimated from objects that did not move.",
    ),
]
Anchor = Annotated[
    str | None,
    typer.Option(
        metavar="POSE=POSE",
        help="One pose known in both frames, which aligns them: X,Z,YAW_DEG as in the snapshot's file, and "
        "as in the scene's.",
    ),
]
Reid = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help=f"{DEFAULT_REID} by default, spatial with an option that belongs to it. Names: {REID_HELP}",
    ),
]
Threshold = Annotated[
    float | None,
    typer.Option(
        metavar="T",
        parser=number(),
        help="Sites to consider, from 0 (the camera's own only) to 1 (all, the default). (*)",
    ),
]
CostWeights = Annotated[
    str | None,
    typer.Option(
        metavar="WT,WR", help="Weights of translation and rotation; the scene's own by default. (*)"
    ),
]
Gate = Annotated[
    bool | None,
    typer.Option(
        "--gate/--no-gate",
        help="Whether labels go only to detections of their category; yes by default. "
        "(*, distance, squared-distance, nearest)",
    ),
]
Solver = Annotated[
    str | None, typer.Option(metavar="NAME", help="Assignment by lsap, the default, or mip. (*)")
]
MinConfidence = Annotated[
    float | None,
    typer.Option(
        metavar="P",
        parser=number(),
        help="Give no label with a lower probability; 0 by default. adaptive and likelihood only.",
    ),
]
Confusion = Annotated[
    float | None,
    typer.Option(
        metavar="P",
        parser=number(),
        help="Probability of a wrong category; 0, the default, keeps it. adaptive and likelihood only.",
    ),
]
Explain = Annotated[
    str | None, typer.Option(metavar="ID", help="Explain why this detection has its label, or has none.")
]


def identify(
    scene: SceneName,
    snapshot: SnapshotFile = None,
    image: ImageFile = None,
    room: Room = None,
    camera: CameraView = None,
    meshes: Meshes = None,
    estimator: Estimator = "network",
    frame: Frame = "map",
    anchor: Anchor = None,
    reid: Reid = None,
    threshold: Threshold = None,
    weights: CostWeights = None,
    gate: Gate = None,
    solver: Solver = None,
    min_confidence: MinConfidence = None,
    confusion: Confusion = None,
    explain: Explain = None,
    plot: Plot = None,
    as_json: AsJson = False,
) -> None:
    """Identify the detections of a snapshot, or what an image shows.

    Warnings, on the error stream and in the JSON, name implausible values.
    Poses are printed in the snapshot's own frame, units and origin.

    A CSV table has the columns id, category, x, z, yaw_deg, w, h, d, in metres and degrees.
    Snapshots on standard input are answered one by one, with --json in a line each; an invalid one is
    answered by an error, and the exit code is 2 at the end.
    Options marked (*) belong to the method spatial, which is the default together with them, and for very
    many objects.
    """
    from farm_ar.cli.inputs import Choices, make_method, read_scene, refuse
    from farm_ar.errors import OptionError
    from farm_ar.reid.checked import known_frame

    known_frame(frame)
    known = read_scene(scene, room)
    choices = Choices(threshold, weights, gate, solver, min_confidence, confusion)
    asked = Asked(known, reid or _usual(choices), explain, plot, as_json, frame, anchor)
    if (snapshot is None) == (image is None):
        raise OptionError("--snapshot", "must be given, or --image instead of it", snapshot)
    if str(snapshot) == "-":
        refuse([("--camera", camera), ("--plot", plot)], "with --snapshot -")
        _answer_stream(asked, make_method(known, asked.reid, choices))
        return
    seen, photo = _seen(asked.scene, snapshot, image, camera, meshes, estimator)
    asked = asked._replace(photo=photo)
    if reid is None:
        asked = asked._replace(reid=_affordable(asked, seen))
    _answer(asked, make_method(known, asked.reid, choices), seen)


class Asked(NamedTuple):
    """A request: the scene, the method's name, and what is shown of an answer, and how."""

    scene: Scene
    reid: str
    explain: str | None
    plot: Path | None
    as_json: bool
    frame: str
    anchor: str | None
    line: int | None = None
    """The line of a stream that is answered, with JSON in one line."""
    photo: Photo | None = None
    """The image, if it is one that is identified."""


def _seen(
    scene: Scene,
    snapshot: Path | None,
    image: Path | None,
    camera: str | None,
    meshes: Path | None,
    estimator: str,
) -> tuple[Snapshot, Photo | None]:
    """The snapshot, from its file or from an image."""
    from farm_ar.cli.inputs import read_snapshot, refuse

    if snapshot is not None:
        refuse([("--meshes", meshes)], "without --image")
        return read_snapshot(snapshot, camera), None
    from farm_ar.cli.from_image import read_photo

    assert image is not None
    photo = read_photo(scene, image, camera, meshes, estimator)
    return photo.snapshot, photo


def _usual(choices: Choices) -> str:
    """The method where none is named."""
    of_spatial = (choices.threshold, choices.weights, choices.gate, choices.solver)
    return DEFAULT_REID if of_spatial == (None,) * len(of_spatial) else "spatial"


def _affordable(asked: Asked, seen: Snapshot) -> str:
    """The usual method, or the paper's where the usual one would take too long."""
    from farm_ar.reid.registry import MOST_PAIRS

    pairs = len(asked.scene.layout) * len(seen.detections)
    return "spatial" if pairs > MOST_PAIRS.get(asked.reid, pairs) else asked.reid


def _answer_stream(asked: Asked, method: Reidentifier) -> None:
    """Answer the snapshots on standard input, each as soon as it is there."""
    import json
    import sys

    from farm_ar.errors import InputError, escaped
    from farm_ar.scenes.streams import numbered_snapshots

    mistakes = 0
    for line, seen in numbered_snapshots(sys.stdin.buffer):
        try:
            if isinstance(seen, InputError):
                raise seen
            _answer(asked._replace(line=line), method, seen)
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


def _answer(asked: Asked, method: Reidentifier, seen: Snapshot) -> None:
    """Identify the detections of a snapshot, and print and draw what is asked for."""
    from farm_ar.cli import reports
    from farm_ar.cli.inputs import check_size, explanation
    from farm_ar.reid.checked import identify_in_frame

    check_size(asked.reid, len(asked.scene.layout), len(seen.detections))
    affordable = reports.Affordable(method, asked.scene)
    anchor = _anchor(asked, seen)
    found = identify_in_frame(asked.scene, seen, affordable, asked.frame, anchor=anchor)
    why = (
        None
        if asked.explain is None
        else explanation(method, found.snapshot, asked.explain, found.identification)
    )
    if asked.plot is not None and asked.photo is not None:
        from farm_ar.cli.from_image import draw_photo

        draw_photo(asked.scene, asked.photo, found.identification, asked.plot)
    elif asked.plot is not None:
        reports.picture_of_identification(asked.scene, found.snapshot, found.identification, asked.plot)
    _warn(asked, found)
    if asked.as_json:
        _print_json(asked, found, why)
    else:
        _print_text(asked, method, found, why)


def _anchor(asked: Asked, seen: Snapshot) -> tuple[Pose, Pose] | None:
    """The pose that is known in both frames, if there is one."""
    from farm_ar.cli.inputs import pose_in
    from farm_ar.errors import OptionError

    if asked.anchor is None:
        return None
    theirs, _, ours = asked.anchor.partition("=")
    if not ours:
        form = "X,Z,YAW_DEG=X,Z,YAW_DEG, of the snapshot's file and of the scene's"
        raise OptionError("--anchor", f"must be given as {form}", asked.anchor)
    return pose_in(seen.world, "--anchor", theirs), pose_in(asked.scene.world, "--anchor", ours)


def _warn(asked: Asked, found: InFrame) -> None:
    """Print the warnings, each with the line of the stream that it is about."""
    from farm_ar.cli import output, reports

    where = "" if asked.line is None else f"line {asked.line}: "
    for warning in found.identification.warnings:
        typer.echo(f"Warning: {where}{output.printable(reports.in_options(warning))}", err=True)


def _print_json(asked: Asked, found: InFrame, why: str | None) -> None:
    from farm_ar.cli import output, reports

    values = {"method": asked.reid} | reports.as_values(found.snapshot, found.identification)
    values |= {} if asked.line is None else {"line": asked.line}
    values |= {} if why is None else {"explanation": why}
    values |= {} if found.alignment is None else reports.frame_values(asked.scene, found.alignment)
    output.print_json(values, asked.line is not None)


def _print_text(asked: Asked, method: Reidentifier, found: InFrame, why: str | None) -> None:
    from farm_ar.cli import output, reports
    from farm_ar.cli.inputs import decided_by_category

    seen, answer = found.snapshot, found.identification
    output.print_line(f"Method: {asked.reid}" + ("" if asked.line is None else f", line {asked.line}"))
    columns = reports.detection_columns(seen.world)
    output.print_table(columns.names, reports.detection_rows(seen, answer), columns.numbers)
    if found.alignment is not None:
        output.print_line(reports.frame_line(asked.scene, found.alignment))
    for words in reports.summarise(asked.scene, seen, answer):
        output.print_line(words)
    if decided := decided_by_category(method, seen, answer):
        which = f"{len(decided)} of {len(seen.detections)} detections ({reports.some(decided)})"
        output.print_line(f"Categories decided the labels of {which}: with --no-gate they would be others")
    if why is not None:
        output.print_line(why)
    if asked.plot is not None:
        output.print_line(f"Wrote {asked.plot}")
