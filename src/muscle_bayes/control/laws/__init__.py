"""Control laws, made of parts: a controller of the error, what it feeds forward, who is heated."""
