"""Safety filters: wished accelerations in, allowed ones out, for any controller (Section III)."""
