"""The graph: poses, chains' lines and points, and the wheels' errors in one least-squares problem."""
