"""Feature-chain SLAM for sonar: values in, values out, the same bits on every machine."""
