"""Why a run ended as it did: by repeating it with one thing changed at a time, and by reading."""
