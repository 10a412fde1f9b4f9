"""How joints move otherwise than they are commanded, and how they are measured."""
