"""Control laws and their parts: inverses, gains, depths, interaction matrices."""
