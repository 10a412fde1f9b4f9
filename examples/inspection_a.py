"""An inspection robot rolls along a cable and passes a spacer, guided by its camera (fig. 11)."""

import numpy as np

import robsim as rs
from robsim.plot import palette


def strip(mission, shown, extent):
    """Draw the ends of some phases; the first drawing includes the rays of the camera."""
    ends = {leg.name: leg.q_end for leg in mission.legs}
    scene = mission.legs[0].scene
    figure = rs.plot.moments(
        scene,
        [ends[phase] for phase in shown],
        list(shown.values()),
        around=f"{scene.robot().name}.centre",
        extent=extent,
        views=["right", "behind"],
    )
    first, thing = next(iter(shown)), scene.objects[0]
    for mark in scene.pose(thing.name) @ thing.marks[:4]:
        x, _, z = np.transpose([scene.pose("eye", ends[first]).position, mark])
        figure.axes[0].plot(x, z, ":", color=palette.PURPLE, linewidth=1, zorder=9)
    return figure


SHOWN = {
    "approach by sight": "it sees the spacer",
    "swing the front arm aside": "the front arm swings aside",
    "the front arm passes": "and passes",
    "roll to the rear arm": "both arms hold",
    "the rear arm passes": "the rear arm passes",
    "set the rear wheel down": "the spacer is behind",
}

if __name__ == "__main__":
    done = rs.load_scenario(rs.examples.path("inspection_a")).run()
    print(done)
    strip(done, SHOWN, extent=(1.3, 0.9)).savefig("inspection_a.png", dpi=150)
