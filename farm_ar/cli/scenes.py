"""`farm-ar scenes`: lists built-in scenes, draws scenes, checks and imports files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from farm_ar.cli.output import saying

app = typer.Typer(no_args_is_help=True, help="List, draw and check scenes.")

NameOrFile = Annotated[
    str,
    typer.Argument(
        metavar="NAME|FILE", help="A built-in scene, or a scene file (.json, or .csv with --room)."
    ),
]
Room = Annotated[
    str | None,
    typer.Option(metavar="W,D", help="Width and depth of the room in metres; for a scene in CSV only."),
]


@app.command("list")
def list_scenes() -> None:
    """List the built-in scenes."""
    from farm_ar.cli.output import print_table
    from farm_ar.cli.reports import SCENE_COLUMNS, SCENE_NUMBERS, scene_rows

    print_table(SCENE_COLUMNS, scene_rows(), SCENE_NUMBERS)


@app.command()
@saying("Drawing")
def show(
    scene: NameOrFile,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The picture, .svg or .png; NAME.svg in this folder by default."),
    ] = None,
    camera: Annotated[
        str | None, typer.Option(metavar="X,Z,YAW_DEG", help="Draw the view of a camera at this pose.")
    ] = None,
    room: Room = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Instead of drawing, print the scene as a scene file.")
    ] = False,
    snapshot: Annotated[
        bool,
        typer.Option("--snapshot", help="Instead of drawing, print a snapshot file of what --camera sees."),
    ] = False,
) -> None:
    """Draw a scene from above.

    The picture has the objects with heading and label, the sites with their cells, the camera's path and,
    with --camera, what is in view.
    """
    from farm_ar.cli.inputs import camera_pose, need, read_scene, refuse
    from farm_ar.cli.output import print_json, print_line
    from farm_ar.scenes import observe, scene_to_dict, snapshot_to_dict

    what = read_scene(scene, room)
    if as_json:
        refuse({"--out": out, "--camera": camera, "--snapshot": snapshot or None}.items(), "with --json")
        print_json(scene_to_dict(what))
    elif snapshot:
        refuse([("--out", out)], "with --snapshot")
        viewer = camera_pose(need("--camera", camera, "with --snapshot, as x,z,yaw_deg"), what.fov)
        print_json(snapshot_to_dict(observe(what.layout, viewer)[0]))
    else:
        from farm_ar.cli.reports import describe, left_out, picture_of_scene

        path = out or Path(f"{Path(scene).stem}.svg")
        picture_of_scene(what, None if camera is None else camera_pose(camera, what.fov), path)
        print_line(f"{what.name}: {describe(what)}")
        for line in left_out(what):
            print_line(line)
        print_line(f"Wrote {path}")


@app.command()
@saying("Checking")
def validate(
    file: Annotated[str, typer.Argument(metavar="FILE", help="A scene file (.json, or .csv with --room).")],
    room: Room = None,
) -> None:
    """Check a scene file, and report what is wrong with it."""
    from farm_ar.cli.inputs import read_scene_file
    from farm_ar.cli.output import print_line
    from farm_ar.cli.reports import describe, some

    scene = read_scene_file(file, room)
    print_line(f"{file}: a valid scene: {describe(scene)}")
    if scene.bounds is not None:
        inside = scene.bounds.contains(scene.layout.position)
        away = [label for label, within in zip(scene.layout.labels, inside, strict=True) if not within]
        if away:
            where = "the bounds" if scene.room is None else "the room [0, w] x [0, d]"
            print_line(f"Note: outside {where} stand {some(away)}")


@app.command("import-unity")
@saying("Reading the Unity scene")
def import_unity(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A Unity scene in text form (.unity).")],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The scene file; NAME.json in this folder by default."),
    ] = None,
    room: Annotated[
        str | None,
        typer.Option(
            metavar="W,D", help="Width and depth of the room in metres; the file's meshSize by default."
        ),
    ] = None,
    sizes: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Sizes of objects without a box collider: CSV with name (guid or category), w, h, d.",
        ),
    ] = None,
    objects: Annotated[
        str, typer.Option(metavar="NAME", help="Parent of the labelled objects.")
    ] = "OriginalObjects",
    sites: Annotated[str, typer.Option(metavar="NAME", help="Parent of the sites.")] = "Sites",
    templates: Annotated[
        str, typer.Option(metavar="NAME", help="Parent of one example per category.")
    ] = "Templates",
    path: Annotated[str, typer.Option(metavar="NAME", help="Object with the camera's path.")] = "Path",
) -> None:
    """Convert a Unity scene to a scene file."""
    from farm_ar.cli.inputs import room_size
    from farm_ar.cli.output import print_line
    from farm_ar.cli.reports import describe
    from farm_ar.scenes import save_scene
    from farm_ar.scenes.unity_files import UnityGroups, load_sizes, load_unity_scene

    known = {} if sizes is None else load_sizes(sizes)
    groups = UnityGroups(objects, sites, templates, path)
    scene = load_unity_scene(file, None if room is None else room_size(room), known, groups)
    target = out or Path(f"{file.stem}.json")
    save_scene(scene, target)
    print_line(f"{scene.name}: {describe(scene)}")
    print_line(f"Wrote {target}")


KINDS = {
    "scene": "farm_ar.scenes.json_files:SCENE",
    "snapshot": "farm_ar.scenes.json_files:SNAPSHOT",
    "camera": "farm_ar.scenes.declarations:CAMERA",
    "session": "farm_ar.reid.session.documents:SESSION",
    "trace": "farm_ar.envs.trace:TRACE",
    "script": "farm_ar.showcases.script:SCRIPT",
    "failures": "farm_ar.agents.stress.failures:REPORT",
    "suite": "farm_ar.benchmark.suite:SUITE",
    "answers": "farm_ar.benchmark.suite:ANSWERS",
}
"""Where each kind of file is declared."""


def schema(
    kind: Annotated[str, typer.Argument(metavar="KIND", help=f"One of {', '.join(KINDS)}.")],
) -> None:
    """Print the JSON Schema of a kind of file.

    A script is TOML; its schema is that of its values. failures is the kind of stress.json.
    """
    from importlib import import_module

    from farm_ar.cli.output import print_json
    from farm_ar.errors import known_name

    module, name = KINDS[known_name("KIND", kind, KINDS)].split(":")
    print_json(getattr(import_module(module), name).schema())


@app.command("schema")
def scene_schema() -> None:
    """Print the JSON Schema of scene files, as `farm-ar schema scene` does."""
    schema("scene")
