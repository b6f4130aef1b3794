"""What we know, in other programs' files."""
