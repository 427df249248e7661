"""The Python client is a re-identifier like any other, and a session of the service."""

import pickle
import socket
from functools import partial

import numpy as np
import pytest

from farm_ar.errors import OptionError, SessionError
from farm_ar.reid import SpatialReid, identify
from farm_ar.scenes import builtin_scene
from farm_ar.service.client import RemoteReid, ServiceError, ServiceSession
from farm_ar.testing import check_reidentifier
from farm_ar.testing.reidentifiers import snapshots_of
from tests.service.conftest import Live, lab, seen_in


def test_it_keeps_the_contract_of_a_re_identifier(server: Live) -> None:
    check_reidentifier(partial(RemoteReid, url=server.url), scenes=("farm", "L1"))


def test_it_answers_what_the_method_answers_here(server: Live, rng: np.random.Generator) -> None:
    scene = builtin_scene("M2")
    remote = RemoteReid(scene, server.url, "spatial")
    for kind, snapshot in snapshots_of(scene, rng):
        here, there = identify(scene, snapshot, SpatialReid(scene)), remote.identify(snapshot)
        assert there.labels == here.labels, kind
        for name in ("cost", "margin"):
            np.testing.assert_allclose(getattr(there, name), getattr(here, name), rtol=1e-9, atol=1e-12)
        assert there.runner_up == here.runner_up
        assert there.reason == here.reason
        assert there.warnings == here.warnings


def test_the_session_ends_with_the_object(server: Live) -> None:
    before = server.service.names
    remote = RemoteReid(lab(), server.url)
    assert len(server.service.names) == len(before) + 1
    del remote
    assert server.service.names == before


def test_a_session_confirms_aligns_fuses_and_undoes(server: Live) -> None:
    session = ServiceSession(server.url, "client")
    with pytest.raises(SessionError, match="must have identified a snapshot before"):
        session.confirm()
    session.begin(lab(), "spatial")
    session.identify(seen_in(lab(), 0.1))
    labels = lab().layout.labels
    session.confirm({"d0": labels[1], "d1": labels[0]})
    places = {one["id"]: one["pose"]["position"] for one in session.state()["objects"]}
    x, z = (lab().layout.position[0] + 0.1).tolist()
    assert places[labels[1]] == {"x": pytest.approx(x), "y": 0.0, "z": pytest.approx(z)}
    assert session.undo()["did"] == "confirm"
    moved = session.align(seen_in(lab()), ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    assert moved["aligned"]
    fused = session.fuse([seen_in(lab(), kept=4), seen_in(lab(), kept=3)])
    assert [one["id"] for one in fused["detections"]] == list(labels[:4])
    other = ServiceSession(server.url, "client")
    with pytest.raises(ServiceError, match="to replace it") as problem:
        other.begin(lab())
    assert problem.value.status == 409
    assert pickle.loads(pickle.dumps(problem.value)).status == 409
    other.begin(lab(), replace=True)
    session.identify(seen_in(lab()))
    session.delete()
    with pytest.raises(ServiceError, match="must be one that was given a layout"):
        other.state()
    for one in (session, other):
        one.close()


def test_where_no_service_answers_the_error_says_so() -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{free.getsockname()[1]}"
        with pytest.raises(OptionError, match="must be one of a service that answers"):
            RemoteReid(lab(), url)
        with pytest.raises(OptionError, match="must be one of a service that answers"):
            RemoteReid(lab(), url.replace("http", "https"), pin="00")
