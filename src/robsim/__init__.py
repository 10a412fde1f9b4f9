"""RobSim: model, simulate and see robots that are guided by cameras."""
