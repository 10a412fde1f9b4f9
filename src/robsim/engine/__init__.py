"""The loop: motion, images, command, judgement and record of runs in lockstep, and its threads."""
