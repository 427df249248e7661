"""Gameplay that can be watched: scripts, and the films made of them."""

from farm_ar.showcases.demo import film_script
from farm_ar.showcases.film import Film, ScriptRecorder
from farm_ar.showcases.script import Script, ScriptError, builtin_scripts, load_script

__all__ = ["Film", "Script", "ScriptError", "ScriptRecorder", "builtin_scripts", "film_script", "load_script"]
