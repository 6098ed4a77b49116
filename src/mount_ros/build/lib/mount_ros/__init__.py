"""What every node of the engine mount shares: topic registry, messages, parameters, safe lifecycle."""
