"""Thin click commands, one a file."""
