"""Control of an IsoNs program's flow: instructions, levels, searches."""
