"""The curves that rails follow, by arc length: line, arc, rounded polyline, catenary.

A curve lies in the plane z = 0 of the frame that it is given in. It begins at its first point (of
a line and an arc the origin, along x), and goes on straight before it and after its end.
"""

from robsim.geometry.curves.arc import Arc as Arc
from robsim.geometry.curves.catenary import Catenary as Catenary
from robsim.geometry.curves.curve import Curve as Curve
from robsim.geometry.curves.line import Line as Line
from robsim.geometry.curves.polyline import Polyline as Polyline
