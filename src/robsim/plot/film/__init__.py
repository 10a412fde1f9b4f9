"""Films of runs: the scene, the images and the curves in step, drawn without a display."""
