"""`sonarlog check`: is this recording sound, and what of it is usable."""
