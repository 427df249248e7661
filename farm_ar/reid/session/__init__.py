"""Sessions: identities over many snapshots of one place, with what is confirmed, corrected and learnt."""

from farm_ar.reid.session.in_play import SessionReid
from farm_ar.reid.session.method import Session
from farm_ar.reid.session.state import Aligned, Committed, Confirmed, Corrected, Event, Look, Looked, State
from farm_ar.reid.session.tracks import Track

__all__ = [
    "Aligned",
    "Committed",
    "Confirmed",
    "Corrected",
    "Event",
    "Look",
    "Looked",
    "Session",
    "SessionReid",
    "State",
    "Track",
]
