"""Robot and chain: the dynamics of Section II.A, and what turns w into forces (Section IV.B)."""
