"""Other people's sonar logs: each format one module that yields rows, and one that writes rows as a recording."""
