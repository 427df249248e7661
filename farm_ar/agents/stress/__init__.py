"""The stress test: how much it takes to break a re-identifier, and what no attack can beat."""

from farm_ar.agents.stress.files import read_failure, write_study
from farm_ar.agents.stress.options import StressOptions
from farm_ar.agents.stress.replaying import Replayed, replay_failure
from farm_ar.agents.stress.study import Study, run_stress
from farm_ar.agents.stress.summary import Summary, summarise

__all__ = [
    "Replayed",
    "StressOptions",
    "Study",
    "Summary",
    "read_failure",
    "replay_failure",
    "run_stress",
    "summarise",
    "write_study",
]
