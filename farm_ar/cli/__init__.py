"""The command line, one thin command per capability.

Importing it is cheap: each command imports what it needs when it runs.
"""

from farm_ar.cli.program import app, main

__all__ = ["app", "main"]
