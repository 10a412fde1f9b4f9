"""Primitive solids of robots and objects, such as block, wheel, ball, capsule and mesh.

Sizes are in metres (in `robsim.classic`, as in the chapter, in centimetres).
"""

from robsim.geometry.primitives.ball import Ball as Ball
from robsim.geometry.primitives.block import Block as Block
from robsim.geometry.primitives.block_pictures import BlockPictures as BlockPictures
from robsim.geometry.primitives.camera_body import CameraBody as CameraBody
from robsim.geometry.primitives.capsule import Capsule as Capsule
from robsim.geometry.primitives.mesh import Mesh as Mesh
from robsim.geometry.primitives.poster import Poster as Poster
from robsim.geometry.primitives.primitive import Primitive as Primitive
from robsim.geometry.primitives.tapered_cylinder import TaperedCylinder as TaperedCylinder
from robsim.geometry.primitives.wheel import Wheel as Wheel
