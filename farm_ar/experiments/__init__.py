"""The paper's experiments, reproduced, with its numbers beside ours."""

from farm_ar.experiments.reproduce import EXPERIMENTS, reproduce, setting_of

__all__ = ["EXPERIMENTS", "reproduce", "setting_of"]
