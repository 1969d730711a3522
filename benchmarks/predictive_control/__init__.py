"""Model predictive control of the median joint, as a yardstick for the laws."""
