"""The serial protocol of the ARCOS/AmigOS/P2OS robots: bytes to frozen values and back, for robot and client alike.

Must not know: ports, clocks, files, threads; a time comes in with the bytes it belongs to.
"""
