"""Nodes of ROS 2: a simulated robot cell, and the controller of an experiment."""
