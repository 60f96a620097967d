"""The deformable object: Section II.B, Lemmas III.1 and III.2, zero dynamics."""
