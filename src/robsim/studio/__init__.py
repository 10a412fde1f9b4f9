"""The studio: a live simulation that browser pages show and change."""
