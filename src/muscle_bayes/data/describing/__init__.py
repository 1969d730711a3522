"""What a NAME.toml says of a run and its rig."""
