"""Many environments in one compiled call: `gymnasium.make_vec` gives them for the ids of this package."""

from farm_ar.envs.batched.entry_point import NotBatchedWarning, make_vector_env
from farm_ar.envs.batched.vector_env import BatchedVectorEnv

__all__ = ["BatchedVectorEnv", "NotBatchedWarning", "make_vector_env"]
