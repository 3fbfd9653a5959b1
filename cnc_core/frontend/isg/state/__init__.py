"""State of a running ISG program: data, no control of the flow."""
