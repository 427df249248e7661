"""Failures that a stress test found, to look at: their cards, and a recording of each."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np

from farm_ar.agents.stress import read_failures, replay_failure
from farm_ar.agents.stress.failures import Replayed
from farm_ar.agents.stress.study import known_case
from farm_ar.errors import OptionError
from farm_ar.game_logic.render_state import RenderState
from farm_ar.geometry import wrap
from farm_ar.reid import REIDENTIFIERS
from farm_ar.scenes import Camera, Layout
from farm_ar.web.messages import FRAMES_PER_SECOND, Json, told_moment, told_scene

STILL_S, CARRIED_S, AFTER_S = 1.5, 1.0, 3.0
"""How long a recording shows the table before, each object on its way, and the answers."""

LOOKS_DOWN = -0.6
"""Pitch of a camera whose height is not known, radians; its height is chosen with the room."""

Failures = Sequence[Mapping[str, Any]]


def shipped_gallery() -> Failures:
    """The failures that come with farm-ar, as `docs/make_gallery.py` made them."""
    with as_file(files("farm_ar.web") / "gallery.json") as path:
        return read_failures(path)


def read_gallery(path: str | os.PathLike[str]) -> Failures:
    """The failures of a stress test.

    Args:
        path: the folder that `farm-ar stress --out` wrote, or its stress.json.

    Raises:
        ReportError: it cannot be used.
        OptionError: a failure is of a re-identifier of somebody's module, whose code is not run here.
    """
    path = Path(path)
    failures = read_failures(path / "stress.json" if path.is_dir() else path)
    for failure in failures:
        if failure["reid"] not in REIDENTIFIERS:
            expected = (
                "must hold failures of methods that come with farm-ar (farm-ar stress-replay shows others)"
            )
            raise OptionError("gallery", expected, failure["reid"])
    return failures


def cards_of(failures: Failures) -> dict[str, Json]:
    """What a page shows of each failure before it is replayed, by the name of its recording.

    Raises:
        OptionError: a failure does not fit its scene.
    """
    cards = {}
    for number, failure in enumerate(failures):
        case = known_case(failure["scene"], failure["case"], failure["jitter"], failure["seed"])
        after = _after(case.layout, failure)
        moved = np.any(after.position != case.layout.position, axis=1) | (after.yaw != case.layout.yaw)
        ways = np.column_stack([case.layout.position, after.position]).round(4).tolist()
        cards[f"failure-{number}"] = {
            "title": f"{failure['reid']}: {failure['wrong']} wrong for "
            f"{100 * failure['effort'] * case.scene.diagonal:.0f} cm",
            "width": case.scene.size[0],
            "depth": case.scene.size[1],
            "labels": list(case.layout.labels),
            "moved": np.flatnonzero(moved).tolist(),
            "ways": ways,
        }
    return cards


def recorded_failure(failure: Mapping[str, Any]) -> Json:
    """A failure as a recording: the table as the method knows it, what is moved, the answers.

    Raises:
        OptionError: it does not fit its scene.
    """
    again = replay_failure(failure)
    if not again.truth:
        raise OptionError("position", "must leave an object in view", failure["position"])
    scene, before = again.case.scene, again.case.layout
    camera, after = _with_height(again.case.camera, scene.diagonal), _after(before, failure)
    nothing = np.zeros(len(before), dtype=bool)

    def frames(truth: Layout, believed: Layout, wrong: Any, phase: str, caption: str) -> Json:
        return told_moment(RenderState(scene, truth, believed, wrong, camera, phase, caption=caption))

    shown = [frames(before, before, nothing, "play", "As the method knows it")] * _count(STILL_S)
    now, moved = before, np.any(after.position != before.position, axis=1) | (after.yaw != before.yaw)
    for i in np.flatnonzero(moved):
        start, one = now, np.arange(len(before)) == i
        turn = wrap(after.yaw - start.yaw)
        for share in np.linspace(0, 1, _count(CARRIED_S))[1:]:
            way = share * one
            position = start.position + way[:, None] * (after.position - start.position)
            now = start.with_poses(position, start.yaw + way * turn)
            shown.append(frames(now, before, nothing, "hand", f"{before.labels[i]} is moved"))
    believed, wrong = _believed(again, before, after)
    answers = _answers(again)
    count = sum(not one["right"] for one in answers["detections"])  # again.wrong is -1 where poses overlap
    verdict = f"{failure['reid']} gives {count} wrong label{'s' * (count != 1)}"
    last = frames(after, believed, wrong, "play", verdict)
    shown += [{**last, "snapshot": answers}, *[last] * _count(AFTER_S)]
    title = f"{verdict} after {100 * again.distance * scene.diagonal:.1f} cm"
    return {
        "kind": "recording",
        "rate": FRAMES_PER_SECOND,
        **told_scene(scene),
        "frames": shown,
        "title": title,
    }


def _believed(again: Replayed, before: Layout, after: Layout) -> tuple[Layout, Any]:
    """Where the labels are believed to be after the answers, and (N,) which of them are on another object."""
    position, yaw = before.position.copy(), before.yaw.copy()
    wrong = np.zeros(len(before), dtype=bool)
    for true, label in zip(again.truth, again.answer.labels, strict=True):
        if label is not None and true is not None:
            i, k = before.index(label), before.index(true)
            position[i], yaw[i], wrong[i] = after.position[k], after.yaw[k], label != true
    return before.with_poses(position, yaw), wrong


def _answers(again: Replayed) -> Json:
    answer, layout = again.answer, again.case.layout
    right = [label == true for label, true in zip(answer.labels, again.truth, strict=True)]
    return {
        "kind": "snapshot",
        "number": 1,
        "detections": [
            {
                "object": -1 if true is None else layout.index(true),
                "label": label,
                "confidence": None if not np.isfinite(sure) else round(float(sure), 3),
                "right": good,
            }
            for true, label, sure, good in zip(
                again.truth, answer.labels, answer.confidence, right, strict=True
            )
        ],
    }


def _after(layout: Layout, failure: Mapping[str, Any]) -> Layout:
    position, yaw = np.array(failure["position"]), np.array(failure["yaw"])
    if len(yaw) != len(layout):
        raise OptionError("position", f"must be those of the scene's {len(layout)} objects", len(yaw))
    return layout.with_poses(position, yaw)


def _with_height(camera: Camera, diagonal: float) -> Camera:
    if camera.height is not None:
        return camera
    return replace(camera, height=np.array(0.35 * diagonal), pitch=np.array(LOOKS_DOWN))


def _count(seconds: float) -> int:
    return round(seconds * FRAMES_PER_SECOND)
