"""Effects between what sensors show and what muscle and rotor do."""
