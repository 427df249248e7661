"""Images posted to the service: a rendered frame gets the right labels, what is no image one line."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import cv2
import httpx
import numpy as np
import pytest

from farm_ar.rendering import HOLOLENS_2, Instance, Mesh, Renderer, View, model
from farm_ar.scenes import Detections, builtin_scene
from farm_ar.service.images import Eye
from farm_ar.service.limits import ServiceLimits
from farm_ar.service.recordings import Recorder, replay
from farm_ar.service.service import Service
from farm_ar.service.store import Store
from farm_ar.vision import PoseEstimates, PoseEstimator, check_question
from farm_ar.vision.base import Image
from tests.service.conftest import Live, layout_body, live

FARM = builtin_scene("farm")
NEAR = np.argsort(FARM.layout.position[:, 1])[:6]
POSE = {"x": 0.6, "y": 0.45, "z": -0.32, "yaw_deg": 0.0, "pitch_deg": -28.0}
VIEW = View(HOLOLENS_2, np.array([0.6, 0.45, -0.32]), 0.0, np.deg2rad(-28.0))
LENS = {name: getattr(HOLOLENS_2, name) for name in ("fx", "fy", "cx", "cy", "width", "height")}
CAMERA: dict[str, Any] = {"frame": "unity", "camera": POSE, "intrinsics": LENS, "timestamp": 4.5}


class Sees(PoseEstimator):
    """Knows where things are in one image, from one camera: what comes in must be just that."""

    def __init__(self, image: Image) -> None:
        self.image = image

    def estimate(self, image: Image, camera: View, meshes: Mapping[str, Mesh]) -> PoseEstimates:
        check_question(image, camera, meshes)
        assert set(meshes) == {"coop", "hutch", "shed"}
        assert np.array_equal(image, self.image)
        np.testing.assert_allclose(camera.eye, VIEW.eye)
        assert (camera.yaw, camera.pitch) == pytest.approx((VIEW.yaw, VIEW.pitch))
        layout = FARM.layout
        names = tuple(layout.category[i] for i in NEAR)
        seen = Detections(names, layout.position[NEAR] + 0.004, layout.yaw[NEAR], layout.size[NEAR])
        nan = np.full(6, np.nan)
        return PoseEstimates(seen, np.tile(1e-4 * np.eye(3), (6, 1, 1)), np.ones(6), nan, nan)


@pytest.fixture(scope="module")
def frame() -> Image:
    layout = FARM.layout
    standing = [
        Instance(
            model(layout.category[i]).fitted(*layout.size[i]),
            np.insert(layout.position[i], 1, 0.0),
            layout.yaw[i],
        )
        for i in range(len(layout))
    ]
    return Renderer(standing).draw(VIEW).rgb


@pytest.fixture(scope="module")
def eye(frame: Image) -> Eye:
    return Eye(Sees(frame), {name: model(name) for name in ("coop", "hutch", "shed")})


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("recorded")


@pytest.fixture(scope="module")
def seeing(eye: Eye, recorded: Path) -> Iterator[Live]:
    limits = ServiceLimits(most_image_bytes=2_000_000, most_pixels=640 * 360)
    yield from live(service=Service(Store(None), limits, recorder=Recorder(recorded), eye=eye))


def png(image: Image) -> bytes:
    return cv2.imencode(".png", image[..., ::-1])[1].tobytes()


def post(client: httpx.Client, camera: Any, image: bytes) -> httpx.Response:
    parts = {"camera": (None, json.dumps(camera)), "image": ("frame.png", image, "image/png")}
    return client.post("/v1/sessions/farm/snapshots", files=parts)


def test_a_rendered_frame_gets_the_right_labels(seeing: Live, frame: Image, eye: Eye, recorded: Path) -> None:
    with seeing.client() as client:
        client.put("/v1/sessions/farm/layout", json=layout_body(FARM, method="spatial"))
        reply = post(client, CAMERA, png(frame)).json()
        assert [one["id"] for one in reply["detections"]] == [FARM.layout.labels[i] for i in NEAR]
        assert reply["header"] == {"stamp": 4.5, "frame_id": "unity"}
        assert client.get("/v1/sessions/farm/state").json()["image"] is True
        assert client.get("/v1/sessions/farm/image").content == png(frame)
        body = {"revision": 1, "snapshot": reply["snapshot"]}
        assert client.post("/v1/sessions/farm/confirm", json=body).status_code == 200
        assert [one.difference for one in replay(recorded, eye)] == [None] * 3
        # The next snapshot has none, and then there is no last image.
        empty = {"frame": "unity", "camera": POSE, "detections": []}
        client.post("/v1/sessions/farm/snapshots", json=empty)
        assert client.get("/v1/sessions/farm/image").status_code == 404


@pytest.mark.parametrize(
    ("change", "image", "status", "said"),
    [
        ({}, b"no image", 422, "must be a PNG or JPEG"),
        ({}, b"", 422, "must have the parts camera, JSON, and image"),
        ({"frame": None}, None, 422, "frame: must be one of unity"),
        ({"frame": "openxr", "camera": {**POSE, "y": -1}}, None, 422, "must be above the plane"),
        ({"intrinsics": {**LENS, "width": 641}}, None, 413, "pixels"),
        ({"intrinsics": {**LENS, "width": 320}}, None, 422, "must be 320 x 360 pixels"),
        ({"timestamp": "now"}, None, 422, "timestamp"),
        ({"timestamp": 1e400}, None, 422, "timestamp"),
        ({}, b"x" * 3_000_000, 413, "bytes"),
    ],
)
def test_what_is_wrong_with_an_image_or_its_camera_is_said(
    seeing: Live, frame: Image, change: dict[str, Any], image: bytes | None, status: int, said: str
) -> None:
    with seeing.client() as client:
        client.put("/v1/sessions/farm/layout", json=layout_body(FARM, method="spatial"))
        reply = post(client, {**CAMERA, **change}, png(frame) if image is None else image)
        assert (reply.status_code, said in reply.text) == (status, True), reply.text


def test_bodies_that_are_no_parts_are_refused(seeing: Live, server: Live, frame: Image) -> None:
    kind = {"Content-Type": "multipart/form-data; boundary=x"}
    with seeing.client() as client:
        for body in (b"", b"--x", b"--x\r\nnonsense\r\n--x--", b"\xff" * 1000):
            reply = client.post("/v1/sessions/farm/snapshots", content=body, headers=kind)
            assert reply.status_code in (400, 422), reply.text
        bare = client.post(
            "/v1/sessions/farm/snapshots", content=b"x", headers={"Content-Type": "multipart/form-data"}
        )
        assert bare.status_code == 400
    with server.client() as client:
        client.put("/v1/sessions/farm/layout", json=layout_body(FARM, method="spatial"))
        reply = post(client, CAMERA, png(frame))
        assert reply.status_code == 422
        assert "without --meshes" in reply.text


def test_a_layout_of_what_has_no_mesh_is_refused_with_an_image(seeing: Live, frame: Image) -> None:
    with seeing.client() as client:
        chair = {"label": "a", "category": "chair", "x": 0, "z": 0}
        body = {"frame": "unity", "objects": [chair], "method": "spatial"}
        state = client.get("/v1/sessions/farm/state")
        body |= {"revision": state.json()["revision"]} if state.is_success else {}
        client.put("/v1/sessions/farm/layout", json=body)
        reply = post(client, CAMERA, png(frame))
        assert reply.status_code == 422
        assert "must be of categories with a mesh, coop, hutch, shed" in reply.text
        client.delete("/v1/sessions/farm")
