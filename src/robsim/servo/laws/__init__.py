"""Control laws and what they are made of: inverses, gains, depths, interaction matrices."""
