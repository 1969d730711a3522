"""Heat: control of the tubes, trust in thermometers, and the heat model that bounds both."""
