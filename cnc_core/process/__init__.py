"""The CNC process: prepares blocks, runs the engine, talks to the shared memory."""
