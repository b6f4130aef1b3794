"""Measurements: accuracy, speed, memory, as ratios against something run side by side."""
