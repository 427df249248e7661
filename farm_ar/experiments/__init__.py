"""The paper's experiments, reproduced, with its numbers beside ours."""

from farm_ar.experiments.reproduce import EXPERIMENTS, reproduce

__all__ = ["EXPERIMENTS", "reproduce"]
