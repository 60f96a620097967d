"""The report's figures, each one panel wide enough for a phone; drawn from analyses and traces."""
