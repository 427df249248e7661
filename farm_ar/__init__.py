"""Which of these identical objects is which? Re-identification from one egocentric snapshot."""

__version__ = "0.1.0"
