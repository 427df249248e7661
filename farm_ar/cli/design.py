"""`farm-ar design`: where to put identical objects so that they are hard to mistake for one another."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from farm_ar.cli.options import Seed, number

if TYPE_CHECKING:
    from farm_ar.agents.design import Design


def design(
    scene: Annotated[
        str, typer.Option(metavar="NAME|FILE", help="The room, its objects and which of them are fixed.")
    ] = "farm",
    objects: Annotated[
        str | None,
        typer.Option(
            metavar="KIND=N,...",
            help="Objects of each category; by default the scene's own, with their labels.",
        ),
    ] = None,
    yaw_limit_deg: Annotated[
        float,
        typer.Option(metavar="DEG", parser=number(0, 180), help="Largest turn of an object to either side."),
    ] = 30.0,
    seed: Seed = 0,
    plot: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the layout, .svg or .png.")] = Path(
        "out/design.svg"
    ),
    save: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write it as a scene, .json, for all other commands.")
    ] = None,
) -> None:
    """Propose a placement in which small displacements of identical objects never give a wrong label.

    Maximises the certified radius: as long as no object has moved further than that, no label is wrong in any
    snapshot of any part of the room.
    """
    import numpy as np

    from farm_ar.agents.design import described, with_objects
    from farm_ar.agents.design import design as search
    from farm_ar.cli.inputs import read_scene
    from farm_ar.cli.output import print_line, print_table
    from farm_ar.cli.places import writing
    from farm_ar.scenes import save_scene

    known = read_scene(scene, None)
    own = described(known)
    wanted = known if objects is None else with_objects(known, _counts(objects))
    found = search(wanted, np.random.default_rng(seed), yaw_limit_deg)
    rows = [
        (name, f"{one.radius:.4f}", f"{100 * one.metres:.1f}", f"{one.degrees:.1f}")
        for name, one in (("the scene's own layout", own), ("this design", found))
    ]
    print_table(("", "certified radius", "cm without turning", "degrees in place"), rows)
    layout = found.scene.layout
    poses = [
        (label, f"{x:.3f}", f"{z:.3f}", f"{np.rad2deg(yaw):.1f}")
        for label, (x, z), yaw in zip(layout.labels, layout.position, layout.yaw, strict=True)
    ]
    print_table(("label", "x", "z", "yaw_deg"), poses, ("x", "z", "yaw_deg"))
    if plot is not None:
        with writing("--plot", plot):
            _draw(found, plot)
        print_line(f"Wrote {plot}")
    if save is not None:
        with writing("--save", save):
            save_scene(found.scene, save)
        print_line(f"Wrote {save}")


def _draw(found: Design, path: Path) -> None:
    """Draw a placement, and around each object how far it may move, unturned, without being mistaken."""
    import numpy as np
    from matplotlib.patches import Circle

    from farm_ar.drawing import draw_scene, new_picture, save_picture

    figure, axes = new_picture(found.scene.size)
    draw_scene(axes, found.scene, path=False, cells=False)
    layout = found.scene.layout
    code = layout.category_code
    for i, (x, z) in enumerate(layout.position.tolist()):
        if np.isfinite(found.metres) and np.count_nonzero(code == code[i]) > 1:
            ring = Circle((x, z), found.metres, fill=False, linewidth=0.6, edgecolor="#059669")
            ring.set_linestyle((0, (4, 3)))
            axes.add_patch(ring)
    save_picture(figure, path)


def _counts(text: str) -> dict[str, int]:
    """Numbers by kind from "coop=5,hutch=4"."""
    from farm_ar.arrays import whole_in
    from farm_ar.errors import OptionError

    counts: dict[str, int] = {}
    for part in text.split(","):
        kind, equals, number = part.partition("=")
        if not equals or (count := whole_in(number)) is None or count < 0 or kind in counts:
            raise OptionError("--objects", "must be KIND=N,KIND=N,... with each kind once", text)
        counts[kind] = count
    return counts
