from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_game_above import HAND, exchanged, start, with_animals

from farm_ar.drawing.floating_labels import stack
from farm_ar.drawing.game_frames import GameFrames
from farm_ar.drawing.game_headset import HeadsetView
from farm_ar.drawing.pinhole import Pinhole
from farm_ar.errors import OptionError
from farm_ar.geometry import camera_frame
from farm_ar.scenes import Camera, FieldOfView
from farm_ar.scenes.builtin import FACING_S1, FACING_S4, builtin_scene
