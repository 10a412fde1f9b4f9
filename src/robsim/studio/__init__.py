"""The studio: a live simulation that pages in a browser show and change."""
