"""Trajectories of joints or of a frame over time, from rest to rest.

- `Quintic`: joints, with minimum jerk and a given duration
- `Trapezoid`: joints, as fast as limits of speed and acceleration allow
- `Blends`: joints, through several points without stopping
- `Straight`: a frame, on a straight line with a rotation about a fixed axis
- `Path`: a frame, through several poses with rest at each

Joint trajectories give positions, velocities and accelerations by `at(t)`, `velocity(t)` and
`acceleration(t)`. Frame trajectories give poses and twists by `at(t)` and `twist(t)`. Times are in
seconds; before and after the motion, the trajectory rests at its start and end.
"""

from robsim.base.lazy_names import attach_names

__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
