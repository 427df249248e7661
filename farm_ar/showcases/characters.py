"""Objects as characters (paper, section 5.2): a gate that lets animals out, a coop that loses its stairs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from farm_ar.drawing.video import write_mp4
from farm_ar.game_logic.events import Parts
from farm_ar.game_logic.headset import field_of_view, random_camera
from farm_ar.game_logic.render_state import RenderState
from farm_ar.scenes import LayoutNoise, builtin_scene
from farm_ar.showcases.film import FPS, ScriptRecorder
from farm_ar.showcases.parts_from_pixels import PixelParts
from farm_ar.showcases.result import Report, Row, Shown, column, percent
from farm_ar.showcases.script import load_script

MOVED = LayoutNoise.of(0.02, 10.0)
"""How things stand otherwise than in the scene, truth and belief alike."""

POSE_SD = (0.002, float(np.deg2rad(2.0)))
"""Errors of believed poses, metres and radians."""

SCRIPT = "characters"


def look(seed: int, number: int, exact: bool) -> list[Row]:
    """One random view of a table whose gate and stairs are as chance has it; what the picture says of each.

    Args:
        seed: of all randomness, with the number.
        number: of the view.
        exact: whether poses are believed exactly.

    Returns:
        A row for each part: whether it was decided, rightly or wrongly; how many pixels say so.
    """
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
    scene = builtin_scene("farm")
    truth = MOVED.disturb(scene.layout, scene.size, rng)
    n, coops = len(truth), [i for i, category in enumerate(truth.category) if category == "coop"]
    shed = int(np.flatnonzero(truth.fixed)[0])
    parts = Parts().with_gate(shed, float(rng.integers(2)))
    for i in coops:
        parts = parts.with_stairs(i, bool(rng.integers(2)))
    shift, turn = (0.0, 0.0) if exact else POSE_SD
    moved = truth.movable
    believed = truth.placed(
        truth.position + moved[:, None] * shift * rng.normal(size=(n, 2)),
        truth.yaw + moved * turn * rng.normal(size=n),
    )
    state = RenderState(
        scene,
        truth,
        believed,
        np.zeros(n, dtype=bool),
        random_camera(scene, field_of_view("photo"), rng),
        missing=dict(parts.missing),
        open_gates=dict(parts.open_gates),
    )
    detector = PixelParts(scene, rng)
    detector.detect(state, Parts().with_gate(shed, 0.0))
    rows = []
    for (part, i), verdict in detector.verdicts.items():
        changed = parts.gate_is_open(i) if part == "gate" else parts.without_stairs(i)
        right = (verdict.log_ratio > 0) == changed
        rows.append(
            {
                "view": number,
                "poses": "exact" if exact else "2 mm, 2°",
                "part": part,
                "of": truth.labels[i],
                "right": verdict.decided and right,
                "wrong": verdict.decided and not right,
                "undecided": not verdict.decided,
                "pixels": verdict.pixels,
                "log_ratio": round(verdict.log_ratio, 2),
            }
        )
    return rows


def show_characters(out: Path, views: int, seed: int, film: bool, report: Report) -> Shown:
    """Look at random tables, play the script with an oracle and from pixels, and sum up."""
    trials: list[Row] = []
    for i in range(views):
        for exact in (True, False):
            trials += look(seed, i, exact)
        report("Looking at gates and stairs", (i + 1) / views)
    shown = Shown(f"Gates and stairs in {views} random pictures (gain, noise and JPEG), by likelihood ratio")
    for part in ("gate", "stairs"):
        for poses in ("exact", "2 mm, 2°"):
            of = [t for t in trials if t["part"] == part and t["poses"] == poses]
            shown.rows.append(_summary(part, poses, of, views))
    script = load_script(SCRIPT)
    for name, parts in (("oracle", None), ("pixels", PixelParts(script.scene, np.random.default_rng(seed)))):
        events = ScriptRecorder(script, make_pictures=None, parts=parts).play().events
        said = "; ".join(f"{event['event']} ({event['of']})" for event in events)
        shown.notes.append(f"The script {SCRIPT}, {name}: {said}.")
    shown.write(out, "characters", trials)
    if film:
        report("Filming", 0.9)
        parts = PixelParts(script.scene, np.random.default_rng(seed))
        shown.paths.append(out / "characters.mp4")
        write_mp4(shown.paths[-1], ScriptRecorder(replace(script), parts=parts).frames(), FPS)
    return shown


def _summary(part: str, poses: str, trials: Sequence[Row], views: int) -> Row:
    """Resampled by views, of which each has five stairs."""

    def by_view(name: str) -> str:
        return percent(column(trials, name).reshape(views, -1).mean(axis=1))

    decided = [trial for trial in trials if not trial["undecided"]]
    wrong = np.mean(column(decided, "wrong")) if decided else 0.0
    return {
        "part": part,
        "believed poses": poses,
        "right": by_view("right"),
        "wrong": by_view("wrong"),
        "undecided": by_view("undecided"),
        "wrong of those decided": f"{wrong:.1%}",
    }
