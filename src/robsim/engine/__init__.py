"""The simulation loop: motion, images, command, termination and record of runs in lockstep."""
