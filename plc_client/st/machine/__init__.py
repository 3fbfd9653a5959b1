"""From C to a running program: compiler, cache, loader, symbols, tasks."""
