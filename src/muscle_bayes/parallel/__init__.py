"""Independent work spread over processes and machines, resumed where it was interrupted."""
