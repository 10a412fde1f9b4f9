// The teach pendant of a robot.
