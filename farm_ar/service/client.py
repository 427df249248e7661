"""The Python client: a session of the service as an object, and as a re-identifier."""

from __future__ import annotations

import os
import ssl
import time
import weakref
from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import urlsplit
from uuid import uuid4

import numpy as np

from farm_ar.arrays import FloatArray
from farm_ar.errors import OptionError, SessionError
from farm_ar.reid import Assurance, Identification, Reidentifier
from farm_ar.scenes import Scene, Snapshot
from farm_ar.scenes.json_files import scene_to_dict, snapshot_to_dict
from farm_ar.service.network import pin_of_der
from farm_ar.service.refusals import BUSY, TOO_MANY, missing_package

try:
    import httpx
except ImportError:
    raise missing_package("httpx") from None

TRIES, TIMEOUT_S = 20, 60.0
"""How often a request is made that the service was too busy for; how long an answer is waited for."""


class ServiceError(SessionError):
    """The service refused a request.

    Args:
        status: of HTTP; 409 where another client has decided something since.
        error: what the service said.
    """

    def __init__(self, status: int, error: Mapping[str, Any]) -> None:
        super().__init__(str(error.get("field")), str(error.get("expected")), error.get("got"))
        self.status = status

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (
            self.status,
            {"field": self.field, "expected": self.expected, "got": self.got},
        )


class ServiceSession:
    """A session of the service. Poses are farm-ar's: metres, radians, Unity's frame.

    Args:
        url: of the service, as `farm-ar serve` prints it.
        name: of the session.
        token: that the service printed, if any.
        pin: SHA-256 of its certificate, as it was printed, for https.
    """

    def __init__(self, url: str, name: str, token: str | None = None, pin: str | None = None) -> None:
        headers = {} if token is None else {"Authorization": f"Bearer {token}"}
        verify = True if pin is None else _pinned(url, pin)
        self.name, self.revision = name, 0
        self._seen: dict[str, Any] | None = None
        self._http = httpx.Client(
            base_url=url, headers=headers, timeout=TIMEOUT_S, verify=verify, trust_env=False
        )

    def begin(
        self,
        scene: Scene,
        method: str = "adaptive",
        options: Mapping[str, Any] | None = None,
        replace: bool = False,
    ) -> None:
        """Begin the session with a layout.

        Args:
            scene: the place as it is known.
            method: one of the service's.
            options: of the method.
            replace: whether a session that is there already is replaced.

        Raises:
            ServiceError: it is refused.
        """
        body = {**scene_to_dict(scene), "frame": "unity", "method": method, "options": dict(options or {})}
        if replace and self.name in self._ask("GET", "/v1/sessions")["sessions"]:
            body["revision"] = self.state()["revision"]
        self.revision = self._ask("PUT", self._path("layout"), body)["revision"]

    def look(self, snapshot: Snapshot) -> dict[str, Any]:
        """Identify a snapshot; the whole reply of the service.

        Raises:
            ServiceError: it is refused.
        """
        self._seen = self._ask("POST", self._path("snapshots"), _body(snapshot))
        self.revision = self._seen["revision"]
        return self._seen

    def identify(self, snapshot: Snapshot) -> Identification:
        """The label of each detection of a snapshot.

        Raises:
            ServiceError: it is refused.
        """
        return _answer(self.look(snapshot))

    def fuse(self, snapshots: Sequence[Snapshot]) -> dict[str, Any]:
        """Identify several snapshots together between which nothing moved; the whole reply.

        Raises:
            ServiceError: they are refused.
        """
        self._seen = self._ask("POST", self._path("snapshots"), {"snapshots": [*map(_body, snapshots)]})
        self.revision = self._seen["revision"]
        return self._seen

    def align(
        self, snapshot: Snapshot, anchor: tuple[Sequence[float], Sequence[float]] | None = None
    ) -> dict[str, Any]:
        """Find the frame of the snapshots from here on; the whole reply.

        Args:
            snapshot: in that frame.
            anchor: one pose (x, z, yaw) there and in the map, metres and radians.

        Raises:
            ServiceError: it is refused.
        """
        body = _body(snapshot) | {"revision": self.revision}
        if anchor is not None:
            poses = [dict(zip(("x", "z", "yaw_rad"), map(float, pose), strict=True)) for pose in anchor]
            body["anchor"] = dict(zip(("here", "map"), poses, strict=True))
        return self._decided("align", body)

    def confirm(
        self,
        labels: Mapping[str, str | None] | None = None,
        commit: bool = True,
        force: bool = False,
    ) -> tuple[str, ...]:
        """Take the labels of the last snapshot for known.

        Args:
            labels: those that were wrong, by detection.
            commit: whether this is the layout from here on.
            force: whether a label may go to a detection of another category than its object's.

        Returns:
            Detections whose labels were more probably wrong than right, and were not corrected.

        Raises:
            ServiceError: it is refused; status 409 if another client has come first.
            SessionError: there was no snapshot.
        """
        if self._seen is None:
            raise SessionError("session", "must have identified a snapshot before", "none")
        decided = {"revision": self._seen["revision"], "snapshot": self._seen["snapshot"]}
        asked = {**decided, "labels": dict(labels or {}), "commit": commit, "force": force}
        return tuple(self._decided("confirm", asked)["doubted"])

    def undo(self) -> dict[str, Any]:
        """Take back the last decision; what it was.

        Raises:
            ServiceError: there is none.
        """
        undone: dict[str, Any] = self._decided("undo", {"revision": self.revision})["undone"]
        return undone

    def state(self) -> dict[str, Any]:
        """All that is known."""
        state = self._ask("GET", self._path("state"))
        self.revision = state["revision"]
        return state

    def delete(self) -> None:
        """Forget the session."""
        self._ask("DELETE", f"/v1/sessions/{self.name}")

    def close(self) -> None:
        """Close the connection; the session stays."""
        self._http.close()

    def _decided(self, action: str, body: Mapping[str, Any]) -> dict[str, Any]:
        reply = self._ask("POST", self._path(action), body)
        self.revision = reply["revision"]
        return reply

    def _path(self, action: str) -> str:
        return f"/v1/sessions/{self.name}/{action}"

    def _ask(self, method: str, path: str, body: Mapping[str, Any] | None = None) -> dict[str, Any]:
        for attempt in range(TRIES):
            try:
                reply = self._http.request(method, path, json=body)
            except httpx.HTTPError as problem:
                expected = f"must be one of a service that answers ({problem or type(problem).__name__})"
                raise OptionError("url", expected, str(self._http.base_url)) from None
            if reply.status_code not in (TOO_MANY, BUSY) or attempt + 1 == TRIES:
                break
            time.sleep(0.05 * (attempt + 1))
        if reply.is_error:
            raise ServiceError(reply.status_code, _said(reply))
        values: dict[str, Any] = reply.json()
        return values


class RemoteReid(Reidentifier):
    """A method that a service carries out; each scene is a session of its own, which ends with this object.

    As `--reid farm_ar.service.client:RemoteReid` it takes what it needs from the environment.

    Args:
        scene: the reference layout and its place.
        url: of the service; $FARM_AR_SERVICE by default, or http://127.0.0.1:8765.
        method: one of the service's; $FARM_AR_METHOD by default, or spatial.
        token: that the service printed, if any; $FARM_AR_TOKEN by default.
        pin: SHA-256 of its certificate; $FARM_AR_PIN by default.

    Raises:
        OptionError: no service answers.
        ServiceError: it refuses the scene.
    """

    def __init__(
        self,
        scene: Scene,
        url: str | None = None,
        method: str | None = None,
        token: str | None = None,
        pin: str | None = None,
    ) -> None:
        given = os.environ.get
        self.scene = scene
        self._session = ServiceSession(
            url or given("FARM_AR_SERVICE") or "http://127.0.0.1:8765",
            f"reid-{uuid4().hex}",
            token or given("FARM_AR_TOKEN"),
            pin or given("FARM_AR_PIN"),
        )
        self._end = weakref.finalize(self, _ended, self._session)
        self._session.begin(scene, method or given("FARM_AR_METHOD") or "spatial")

    def identify(self, snapshot: Snapshot) -> Identification:
        """The label of each detection.

        Raises:
            ServiceError: the service refuses the snapshot.
        """
        return self._session.identify(snapshot)

    def close(self) -> None:
        """Forget the session."""
        self._end()


def _ended(session: ServiceSession) -> None:
    try:
        session.delete()
    except (SessionError, OptionError, RuntimeError):
        pass
    finally:
        session.close()


def _body(snapshot: Snapshot) -> dict[str, Any]:
    return {**snapshot_to_dict(snapshot), "frame": "unity"}


def _answer(reply: Mapping[str, Any]) -> Identification:
    rows = reply["detections"]
    others = [row["alternatives"][0]["id"] if row["alternatives"] else None for row in rows]
    return Identification(
        labels=tuple(row["id"] for row in rows),
        cost=_numbers(rows, "cost"),
        solve_time=reply["solve_ms"] / 1000,
        assurance=Assurance(
            margin=_numbers(rows, "margin"),
            runner_up=tuple(others),
            confidence=_numbers(rows, "confidence"),
            warnings=tuple(reply["warnings"]),
        ),
        reason=tuple(row["reason"] for row in rows),
    )


def _numbers(rows: Sequence[Mapping[str, Any]], name: str) -> FloatArray:
    return np.array([np.nan if row[name] is None else row[name] for row in rows], dtype=np.float64)


def _said(reply: httpx.Response) -> Mapping[str, Any]:
    try:
        error: Mapping[str, Any] = reply.json()["error"]
    except (ValueError, KeyError, TypeError):
        return {"field": "reply", "expected": "must be of farm-ar's service", "got": reply.text[:60]}
    return error


def _pinned(url: str, pin: str) -> ssl.SSLContext:
    """A context that trusts one certificate.

    Raises:
        OptionError: the service has another, or does not answer.
    """
    place = urlsplit(url)
    try:
        found = ssl.get_server_certificate((place.hostname or "", place.port or 443), timeout=TIMEOUT_S)
    except OSError as problem:
        raise OptionError("url", f"must be one of a service that answers ({problem})", url) from None
    seen = pin_of_der(ssl.PEM_cert_to_DER_cert(found))
    if seen.replace(":", "").lower() != pin.replace(":", "").lower():
        raise OptionError("pin", "must be the SHA-256 of the service's certificate", pin)
    context = ssl.create_default_context(cadata=found)
    context.check_hostname = False  # it is this certificate, whatever the address
    return context
