"""Files: scenarios, robots and examples as TOML, runs as NetCDF."""
