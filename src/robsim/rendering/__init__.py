"""Pictures of bodies as a camera sees them, without a graphics card."""
