"""Shapes of bodies, their inertia, the curves of rails, and the light of pictures."""

from robsim.geometry import curves as curves
from robsim.geometry.grey_picture import GreyPicture as GreyPicture
from robsim.geometry.inertia import Inertia as Inertia
from robsim.geometry.primitives import Ball as Ball
from robsim.geometry.primitives import Block as Block
from robsim.geometry.primitives import BlockPictures as BlockPictures
from robsim.geometry.primitives import CameraBody as CameraBody
from robsim.geometry.primitives import Capsule as Capsule
from robsim.geometry.primitives import Mesh as Mesh
from robsim.geometry.primitives import Poster as Poster
from robsim.geometry.primitives import TaperedCylinder as TaperedCylinder
from robsim.geometry.primitives import Wheel as Wheel
from robsim.geometry.triangle_mesh import TriangleMesh as TriangleMesh
from robsim.rendering.light import Light as Light
