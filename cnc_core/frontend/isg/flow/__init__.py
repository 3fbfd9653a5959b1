"""Control of an ISG program's flow: branches, loops, levels, block search."""
