"""Plane curves for rails, by arc length: line, arc, rounded polyline and catenary.

A curve is in the plane z = 0 of its frame. A line and an arc begin at the origin, along x; other
curves begin at their first point. Every curve continues straight before its beginning and after
its end.
"""

from robsim.geometry.curves.arc import Arc as Arc
from robsim.geometry.curves.catenary import Catenary as Catenary
from robsim.geometry.curves.curve import Curve as Curve
from robsim.geometry.curves.polyline import Line as Line
from robsim.geometry.curves.polyline import Polyline as Polyline
