"""Write a simulated run as a ROS 2 bag, read the bag as a run, and explain the run.

The robot in the bag has a lower gain, joint lag and delayed images. The bag is read with the
planned experiment, which contains none of these; `explain` finds them in the log.
Needs `pip install 'robsim[ros]'`.
"""

import warnings

import robsim as rs

planned = rs.load_scenario(rs.examples.path("chapter_6_1"))
robot = planned.at("task.gain", 0.8 * planned.task.gain).with_(
    sensing=rs.Sensing(latency=0.08), actuation=rs.Actuation(lag=0.1)
)
rs.logs.write_bag(robot.run(), "robot.mcap", start=1.7e9)  # seconds since 1970, like a recorder

run = rs.logs.read_bag("robot.mcap", planned)
print(rs.explain(run))
print()
print(rs.compare({"robot": run, "planned": planned}))

with warnings.catch_warnings():
    warnings.simplefilter(
        "ignore", rs.errors.ReplayWarning
    )  # the commands differ, as explained above
    commanded = rs.replay(run)
away = abs(commanded.qd - run.qd).max("time")
print()
print("largest difference of a command (rad/s):")
for joint in run.velocity.values:
    print(f"  {joint:10} {float(away.sel(velocity=joint)):.4f}")

same = rs.logs.read_bag("robot.mcap")  # with the experiment stored in the bag: the robot's own
print()
print("to the bit with its own experiment:", bool((same.q == run.q).all()), end=", ")
print("lag", rs.Experiment.of(same).actuation.lag, "s")
