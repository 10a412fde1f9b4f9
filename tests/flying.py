"""A camera that flies to a square, in four seconds."""

TEXT = """
schema = 1
robots = [{ model = "free_camera" }]
cameras = [{ name = "eye", on = "free_camera.body", focal = 500, size = [640, 480] }]
task = { kind = "ibvs", gain = 2 }
run = { duration = "4 s" }
[[objects]]
name = "square"
position = "0, 0, 1 m"
marks = ["-10, -10, 0 cm", "10, -10, 0 cm", "10, 10, 0 cm", "-10, 10, 0 cm"]
"""
