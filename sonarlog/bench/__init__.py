"""The bench: worlds × seeds × conditions × algorithms on the embedded robot, and what comes of it.

Must not know: terminals, options, exit codes.
"""
