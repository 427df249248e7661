"""The stress test: how much it takes to break a re-identifier, and what no attack can beat."""

from farm_ar.agents.stress.failures import Replayed, ReportError, read_failure, read_failures, replay_failure
from farm_ar.agents.stress.report import Summary, summarise, write_study
from farm_ar.agents.stress.study import StressOptions, Study, run_stress

__all__ = [
    "Replayed",
    "ReportError",
    "StressOptions",
    "Study",
    "Summary",
    "read_failure",
    "read_failures",
    "replay_failure",
    "run_stress",
    "summarise",
    "write_study",
]
