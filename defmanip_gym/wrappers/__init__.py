"""Wrappers around the environments, one per file."""
