"""Images and windows."""
