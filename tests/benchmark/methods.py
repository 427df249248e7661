"""Methods that go wrong, for the benchmark to survive."""

import time

import numpy as np

from farm_ar.reid import DistanceReid, Identification
from farm_ar.reid.answers import Assurance


class Raises:
    def __init__(self, scene):
        self.scene = scene

    def identify(self, snapshot):
        raise ZeroDivisionError("by nothing")


class Garbage:
    def __init__(self, scene):
        self.scene = scene

    def identify(self, snapshot):
        return "labels"


class Strange(Garbage):
    def identify(self, snapshot):
        return Identification(("nobody",) * len(snapshot.detections))


class Short(Garbage):
    def identify(self, snapshot):
        return Identification(())


class TooSure(DistanceReid):
    def identify(self, snapshot):
        found = super().identify(snapshot)
        return Identification(found.labels, assurance=Assurance(confidence=np.full(len(found.labels), 1.5)))


class Hangs(Garbage):
    def identify(self, snapshot):
        time.sleep(3600)


class Honest(DistanceReid):
    """Right as the distance is, and says .9."""

    def identify(self, snapshot):
        found = super().identify(snapshot)
        return Identification(found.labels, assurance=Assurance(confidence=np.full(len(found.labels), 0.9)))
