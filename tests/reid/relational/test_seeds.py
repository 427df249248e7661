"""The motions that are looked at first are scored as a mixture, detection by detection."""

import numpy as np
import pytest

from farm_ar.reid import RelationalReid
from farm_ar.reid.relational import search
from farm_ar.scenes import Camera, LayoutNoise, builtin_scene, observe


def scored(known, limits, sight, group, motion, density):
    """Log likelihood of the detections, each of a label that moved with the group, or not, or of none."""
    variance = known.models.translation_sd[limits.translation_scale] ** 2 + known.detecting.position_sd**2
    stays = np.ones(density.shape[1])
    stays[group.label] -= group.member
    total = sight.nothing + density @ stays
    sine, cosine = np.sin(motion[2]), np.cos(motion[2])
    for j, member in zip(group.label, group.member, strict=True):
        x, z = known.labels.position[j] - group.pivot
        turned = np.array((cosine * x + sine * z, cosine * z - sine * x))
        there = group.pivot + turned + motion[:2]
        squares = ((sight.found.position[0] - there) ** 2).sum(axis=1) / variance
        turn = sight.found.yaw[0] - known.labels.yaw[j] - motion[2]
        period = known.labels.period[j]
        heading = np.full(len(turn), 1 / (2 * np.pi))
        if period > 0:
            table = known.models.heading[limits.rotation_scale, known.labels.table[j]]
            off = np.abs(turn / period - np.round(turn / period))
            heading = table[np.minimum(2 * off * (len(table) - 1) + 0.5, len(table) - 1).astype(int)]
        near = np.where(squares <= 50, np.exp(-squares / 2), 0.0) / (2 * np.pi * variance)
        total = total + member * (1 - limits.wide) * near * heading * sight.like[:, j]
    prior = group.shift_precision * (motion[:2] ** 2).sum() / 2 + group.turn_concentration * (1 - cosine)
    return np.log(total).sum() - prior


@pytest.mark.parametrize("name", ["classroom", "farm"])
def test_scores_are_those_of_the_mixture(name, monkeypatch):
    scene = builtin_scene(name)
    rng = np.random.default_rng(3)
    moved = LayoutNoise.of(0.05 * scene.diagonal, 20.0).disturb(scene.layout, scene.size, rng)
    camera = Camera(scene.layout.position.min(axis=0), np.asarray(0.7), scene.fov)
    snapshot, _ = observe(moved, camera)
    compared = 0
    usual = search.best_motions

    def checked(known, limits, sight, reach, groups, kept):
        nonlocal compared
        found = usual(known, limits, sight, reach, groups, kept)
        narrow = reach.place[limits.translation_scale] * reach.heading[limits.rotation_scale]
        wide = reach.place[-1] * reach.heading[-1]
        density = sight.like * ((1 - limits.wide) * narrow + limits.wide * wide)
        for group, motions in zip(groups, found, strict=True):
            for score, *motion in motions:
                expected = scored(known, limits, sight, group, np.array(motion), density)
                assert score == pytest.approx(expected, rel=1e-9, abs=1e-9)
                compared += 1
            assert motions == sorted(motions, key=lambda one: -one[0])
        return found

    monkeypatch.setattr(search, "best_motions", checked)
    RelationalReid(scene).identify(snapshot)
    assert compared > 10
