"""The nodes of RobSim as executables of a ROS 2 workspace."""
