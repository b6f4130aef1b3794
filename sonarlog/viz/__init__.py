"""Inspecting a replay in Rerun's viewer, sweep by sweep; `rerun_door` is the only module that knows Rerun."""

import os

# Before Rerun is loaded: what its writer finds wrong with a disk is raised, and need not be printed as well.
os.environ.setdefault("RUST_LOG", "warn,re_log_encoding=off,re_sdk=off")
