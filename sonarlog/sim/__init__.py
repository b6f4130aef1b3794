"""The embedded robot: an AmigoBot in a drawn world on the other end of the real protocol, the same bits everywhere.

Must not know: who drives it, wall clocks (only the server paces by one, and is given it), recordings, SLAM.
"""
