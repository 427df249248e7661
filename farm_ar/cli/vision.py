"""`farm-ar vision`: evaluates and trains estimators of poses from images."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from farm_ar.cli.options import AsJson, Seed, whole

if TYPE_CHECKING:
    from farm_ar.cli.output import Report
    from farm_ar.rendering import Mesh
    from farm_ar.vision.scoring import Frame

app = typer.Typer(help="Poses from images: evaluate and train estimators.", no_args_is_help=True)

Meshes = Annotated[
    Path | None, typer.Option(metavar="FOLDER", help="Meshes by category; the farm's by default.")
]


@app.command("benchmark")
def vision_benchmark(
    frames: Annotated[
        list[Path], typer.Argument(metavar="FOLDER...", help="Folders with frames and their truth.")
    ],
    estimator: Annotated[
        str, typer.Option(metavar="NAME", help="network, or module:Class of your own.")
    ] = "network",
    meshes: Meshes = None,
    count: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Frames of each folder; all by default.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Evaluate an estimator on frames with ground truth, one table per folder.

    Missed: no estimate of its category within 5 cm. False: an estimate where no such object is.
    Times are of one processor.
    """
    import cv2

    from farm_ar.cli.output import print_json, print_line, print_table, progress
    from farm_ar.scenes.files import json_values
    from farm_ar.vision.registry import load_estimator
    from farm_ar.vision.scoring import COLUMNS, evaluate, frame_files, table_rows

    cv2.setNumThreads(1)
    judged, answers = load_estimator(estimator), {}
    for folder in frames:
        files = frame_files(folder, count)
        things = _meshes(meshes)
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


@app.command("train")
def vision_train(
    out: Annotated[Path, typer.Option(metavar="MODEL", help="The network, a file that ends in .onnx.")],
    meshes: Meshes = None,
    images: Annotated[
        int, typer.Option(metavar="N", parser=whole(1), help="Number of training images.")
    ] = 100_000,
    frames: Annotated[
        int, typer.Option(metavar="N", parser=whole(1), help="Frames for the calibration at the end.")
    ] = 200,
    seed: Seed = 0,
    threads: Annotated[int, typer.Option(metavar="N", parser=whole(1), help="Of the network.")] = 1,
    workers: Annotated[int, typer.Option(metavar="N", parser=whole(1), help="Processes that render.")] = 1,
    resume: Annotated[bool, typer.Option("--resume", help="Continue an interrupted run.")] = False,
) -> None:
    """Train a network that finds objects in images, on random renders of their meshes.

    It takes about an hour on two cores. MODEL.onnx is the network, MODEL.json its categories and its
    calibration; MODEL.checkpoint, from which --resume continues, can be deleted at the end.
    """
    from farm_ar.cli.output import print_line, progress
    from farm_ar.vision.training import need_packages

    need_packages()
    from farm_ar.vision.training.calibration import calibrate
    from farm_ar.vision.training.training import Training, check_ending, train

    check_ending(out)
    known = _meshes(meshes)
    training = Training(images=images, seed=seed, threads=threads, workers=workers)
    with progress(f"Training on renders of {', '.join(sorted(known))}") as report:
        train(known, out, training, report, resume)
    with progress(f"Calibrating on {frames} frames") as report:
        calibrate(out, known, frames, report)
    print_line(f"Wrote {out} and {out.with_suffix('.json').name} beside it")


@app.command("render")
def vision_render(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Where the frames go.")],
    meshes: Meshes = None,
    count: Annotated[int, typer.Option(metavar="N", parser=whole(1), help="Frames.")] = 10,
    seed: Seed = 0,
) -> None:
    """Render random training frames with their ground truth: a folder for `vision benchmark`."""
    import json

    import cv2

    from farm_ar.cli.options import make_folder
    from farm_ar.cli.output import print_line, progress
    from farm_ar.vision.frames import document, random_frames

    known = _meshes(meshes)
    make_folder("--out", out)
    with progress(f"Rendering {count} frames") as report:
        for number, frame in enumerate(random_frames(known, count, seed)):
            cv2.imwrite(str(out / f"{frame.name}.png"), frame.image[..., ::-1])
            (out / f"{frame.name}.json").write_text(json.dumps(document(frame), indent=1) + "\n")
            report(f"Rendering {number + 1} of {count}", (number + 1) / count)
    print_line(f"Wrote {count} frames and their truth to {out}")


def _meshes(folder: Path | None) -> dict[str, Mesh]:
    from farm_ar.vision.photos import categories_in
    from farm_ar.vision.scoring import farm_meshes

    return farm_meshes() if folder is None else categories_in(folder)
