"""The HLI: layout, shared memory, handshake."""
