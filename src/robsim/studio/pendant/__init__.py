"""The teach pendant: a robot that is moved by its joints or by its tool, and poses to replay."""
