"""Avoid a joint limit with six joints and a task of rank six (Marey and Chaumette 2010)."""

import matplotlib.pyplot as plt

import robsim as rs
from robsim.plot import palette


class Unprojected:
    """The joint law plus a motion away from the limits, without a projection."""

    name, in_camera = "unprojected", False

    def __init__(self, away, limits):
        self.away, self.limits = away, limits

    def command(self, state):
        return rs.laws.JointLaw().command(state) + self.away.velocity(state.q, self.limits)


scenario = rs.load_scenario(rs.examples.path("joint_limits"))
goal, away = scenario.task.goal, scenario.task.secondary
tasks = {
    "plain": rs.IBVS(goal),
    "classic projection": rs.IBVS(goal, secondary=away),
    "large projection": scenario.task,
    "not projected": rs.IBVS(goal, law=Unprojected(away, scenario.scene.limits)),
}
found = rs.compare(scenario.scene, tasks, scenario.start, dt=0.02, duration=20)
print(found)

plt.rcParams["font.size"] = 9
figure, (left, right) = plt.subplots(1, 2, figsize=(7, 3.2), layout="constrained")
colors = (palette.VERMILLION, palette.BLACK, palette.BLUE, palette.GREEN)
for (name, run), color, line in zip(found.runs.items(), colors, ("-", ":", "-", "--"), strict=True):
    lived, thick = run.dropna("time"), 3 if name == "plain" else 1.6
    hit = int(run.outcome) == rs.Outcome.JOINT_LIMIT
    end = {"marker": "X", "markevery": [-1], "markersize": 8} if hit else {}
    lift = 100 * lived.q.sel(coordinate="lift")
    left.plot(lived.time, lift, line, color=color, label=name, linewidth=thick, **end)
    right.semilogy(lived.time, lived.error_norm, line, color=color, linewidth=thick, **end)
low, high = 100 * scenario.scene.limits[2]
left.axhspan(low - 4, low, color=palette.GREY)
left.axhspan(low, low + away.margin * (high - low), color=palette.FAINT, zorder=0)
left.annotate("limit", (4, low - 2), ha="center", va="center", color="w")
left.set(xlabel="time (s)", ylabel="lift, from the rails down (cm)", xlim=(0, 8), ylim=(48, 16))
left.annotate("within the margin", (4, low + 1), ha="center", va="top", color=palette.GREY)
right.set(xlabel="time (s)", ylabel="||e||", xlim=(0, 10.5))
right.legend(*left.get_legend_handles_labels(), frameon=False, loc="upper right")
for axes in (left, right):
    axes.grid(True, color=palette.LIGHT_GREY, linewidth=0.5)
    axes.spines[["top", "right"]].set_visible(False)
figure.savefig("joint_limits.png", dpi=240)
