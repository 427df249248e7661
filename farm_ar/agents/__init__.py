"""Players of the environments, attacks on re-identifiers, certificates, and the stress test made of them."""

from farm_ar.agents.adversaries import load_adversary

__all__ = ["load_adversary"]
