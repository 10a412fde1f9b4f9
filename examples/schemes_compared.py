"""Compare seven schemes from one start by the measures of Gans, Hutchinson and Corke 2003."""

import robsim as rs

scenario = rs.load_scenario(rs.examples.path("schemes_compared"))
goal = scenario.task.goal
tasks = {
    "IBVS, L current": rs.IBVS(goal),
    "IBVS, L desired": rs.IBVS(goal, interaction="desired"),
    "IBVS, L mean": rs.IBVS(goal, interaction="mean"),
    "PBVS, goal form": rs.PBVS(goal, form="goal"),
    "PBVS, camera form": rs.PBVS(goal, form="camera"),
    "2 1/2 D": rs.Hybrid(goal),
    "partitioned": rs.Partitioned(goal),
}
found = rs.compare(scenario.scene, tasks, scenario.start, dt=0.02, duration=20)
print(found)
rs.plot.comparison(found).savefig("schemes_compared.png", dpi=130)
