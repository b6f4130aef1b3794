"""The paper's one-time self-calibration [III.B]: what a robot's odometry and sonars get wrong, once and for all."""
