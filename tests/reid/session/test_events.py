"""The state is the fold of the events not undone, in whatever order they came, saved and loaded between."""

import json
from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from farm_ar.errors import SessionError
from farm_ar.reid import Identification, Session
from farm_ar.reid.session import Looked
from farm_ar.reid.session.state import fold
from farm_ar.scenes import (
    Camera,
    Detections,
    FieldOfView,
    Layout,
    Scene,
    Snapshot,
    scene_to_dict,
    snapshot_to_dict,
)

FOV = FieldOfView(0.6, 0.6, 6.0)
LABELS = ("a", "b", "c", "d", "e")


class ByName:
    """Says of each detection what its id begins with, where the scene has it: it can be foretold."""

    def __init__(self, scene):
        self.scene = scene

    def identify(self, snapshot):
        known = self.scene.layout.labels
        return Identification(tuple(i[0] if i[0] in known else None for i in snapshot.detections.ids))


def place(seed):
    rng = np.random.default_rng(seed)
    layout = Layout(
        LABELS,
        ("box",) * 5,
        rng.uniform(-3, 3, (5, 2)) + 1e5,
        rng.uniform(-3, 3, 5),
        rng.uniform(0.1, 0.3, (5, 3)),
        fixed=np.array([False] * 4 + [True]),
    )
    return Scene("place", None, layout)


def snapshot(seed, tracked):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(0, 7))
    ids = tuple(str(name) for name in rng.permutation(["a", "b", "c", "d", "e", "x", "y"])[:n])
    yaw = np.where(rng.random(n) < 0.2, np.nan, rng.uniform(-7, 7, n))
    category = tuple(None if r < 0.1 else "box" for r in rng.random(n))
    lost = rng.random(n) < 0.1
    position, size = rng.uniform(-3, 3, (n, 2)) + 1e5, rng.uniform(0.1, 0.3, (n, 3))
    position[lost], yaw[lost], size[lost] = np.nan, np.nan, np.nan
    seen = Detections(
        category,
        position,
        yaw,
        size,
        ids=ids,
        track_id=tuple(f"t{name}" for name in ids) if tracked else None,
        broken=tuple("x: must be a number, got None" if one else None for one in lost),
    )
    eye = Camera(rng.uniform(-3, 3, 2) + 1e5, rng.uniform(-3, 3), FOV)
    return Snapshot(eye, seen, float(seed))


def described(state):
    """A state as values that can be compared."""
    look = state.look and {
        "snapshot": snapshot_to_dict(state.look.snapshot),
        "labels": state.look.labels,
        "tracks": [t and (t.start, t.held, dict(t.belief)) for t in state.look.tracks],
        "confirmed": state.look.confirmed,
        "broken": state.look.snapshot.detections.broken,
        "doubted": state.look.doubted,
    }
    return {
        "scene": scene_to_dict(state.scene),
        "frame": state.frame,
        "look": look,
        "seen": json.loads(json.dumps(dict(state.seen))),
        "viewed": sorted(state.viewed),
        "lost": state.lost,
        "learnt": state.learnt and state.learnt.to_json(),
    }


def same(one, other):
    return json.dumps(described(one), default=str) == json.dumps(described(other), default=str)


def nearly(one, other):
    """Whether values are the same but for numbers' last digits, which files round in another frame."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(nearly(one[name], other[name]) for name in one)
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(nearly, one, other))
    return one == other if not isinstance(one, float) else np.isclose(one, other, 1e-12, 1e-9, equal_nan=True)


def step(session, kind, seed, tracked):
    """Let one thing happen; whether it did."""
    rng = np.random.default_rng(seed)
    look = session.state.look
    ids = () if look is None else look.snapshot.detections.ids
    try:
        if kind == "look":
            session.identify(snapshot(seed, tracked))
        elif kind == "align":
            poses = rng.uniform(-5, 5, (2, 3))
            session.align(snapshot(0, False), (tuple(poses[0]), tuple(poses[1])), at_least=0.0)
        elif kind == "correct":
            names = rng.permutation([*LABELS, "n1", "n2"])
            some = rng.permutation(list(ids))[: rng.integers(0, 4)]
            session.correct({str(i): str(name) for i, name in zip(some, names, strict=False)})
        elif kind == "confirm":
            session.confirm()
        else:
            session.commit()
    except SessionError:
        return False
    return True


STEPS = st.lists(
    st.tuples(
        st.sampled_from(
            ["look", "look", "align", "correct", "confirm", "confirm", "commit", "undo", "save", "settle"]
        ),
        st.integers(0, 10**6),
    ),
    max_size=25,
)


@settings(max_examples=settings().max_examples // 4)
@given(steps=STEPS, seed=st.integers(0, 100))
def test_any_order_of_steps_saves_and_loads_gives_the_steps_not_undone(steps, seed, tmp_path_factory):
    path = tmp_path_factory.getbasetemp() / f"session-{seed}.json"
    session, done, final = Session(place(seed), ByName), [], 0
    for kind, number in steps:
        before = session.events
        if kind == "save":
            session.save(path)
            session = Session.load(path, ByName)
            assert len(session.events) == len(before)
        elif kind == "undo":
            decisions = [i for i, (name, _) in enumerate(done) if name != "look"]
            try:
                session.undo()
                done.pop(decisions[-1])
            except SessionError:
                assert len(decisions) == final
        elif kind == "settle":
            now = sum(name != "look" for name, _ in done) - final
            session.settle(min(number % 3, now))
            final += min(number % 3, now)
            assert sum(not isinstance(event, Looked) for event in session.events) == now - min(
                number % 3, now
            )
        elif step(session, kind, number, tracked=False) and session.events is not before:
            done.append((kind, number))
    again = Session(place(seed), ByName)
    for kind, number in done:
        step(again, kind, number, tracked=False)
    assert nearly(described(session.state), described(again.state))
    assert final or same(session.state, again.state)


@settings(max_examples=max(15, settings().max_examples // 5))
@given(steps=STEPS)
def test_with_tracks_and_learning_the_state_is_the_fold_of_the_events_kept(steps, tmp_path_factory):
    path = tmp_path_factory.getbasetemp() / "tracked.json"
    session = Session(place(1))
    for kind, number in steps:
        if kind == "save":
            session.save(path)
            loaded = Session.load(path)
            assert same(loaded.state, session.state)
            loaded.save(path.with_suffix(".again"))
            assert path.with_suffix(".again").read_text() == path.read_text()
            session = loaded
        elif kind == "undo":
            try:
                session.undo()
            except SessionError:
                continue
        elif kind == "settle":
            session.settle(min(number % 2, sum(not isinstance(event, Looked) for event in session.events)))
        else:
            step(session, kind, number, tracked=True)
        assert same(fold(session._begin, session.events), session.state)
    looks = [isinstance(event, Looked) for event in session.events]
    assert not any(one and two for one, two in pairwise(looks))
