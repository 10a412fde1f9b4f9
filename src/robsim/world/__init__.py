"""The world of an experiment: scenes, motions, sensing, actuation and beliefs."""
