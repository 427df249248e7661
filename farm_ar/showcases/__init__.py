"""Scripts of the game, and films of them and of episodes."""

from farm_ar.showcases.demo import film_script
from farm_ar.showcases.film import Film, ScriptRecorder
from farm_ar.showcases.script import Script, ScriptError, builtin_scripts, load_script

__all__ = ["Film", "Script", "ScriptError", "ScriptRecorder", "builtin_scripts", "film_script", "load_script"]
