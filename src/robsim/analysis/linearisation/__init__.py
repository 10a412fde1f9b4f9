"""What `advise` is made of: the linear loop at rest, its limit, its noise, its calibration."""
