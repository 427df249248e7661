"""A session as a re-identifier: for the game, where no answer is corrected, and every one is believed."""

from __future__ import annotations

from farm_ar.reid.answers import Identification
from farm_ar.reid.base import Reidentifier
from farm_ar.reid.registry import ReidFactory
from farm_ar.reid.session.method import Session
from farm_ar.scenes import Scene, Snapshot


class SessionReid(Reidentifier):
    """Identifies in a session that goes on, and takes each answer for right: it is confirmed and committed.

    It is made for a scene as it is believed to be by calling it, and is then itself: the session's layout is
    what the answers so far made of the first scene.

    Args:
        make_reid: the method of the session.
    """

    def __init__(self, make_reid: ReidFactory) -> None:
        self._make = make_reid
        self._session: Session | None = None

    def __call__(self, scene: Scene) -> SessionReid:
        """Itself, which begins with the first scene."""
        self.scene = scene
        self._session = self._session or Session(scene, self._make)
        return self

    def identify(self, snapshot: Snapshot) -> Identification:
        """The label of each detection, in the light of all answers before; learns from this one."""
        session = self._session
        assert session is not None, "must be called with a scene first"
        answer = session.identify(snapshot)
        session.confirm()
        session.commit()
        return answer
