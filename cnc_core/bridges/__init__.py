"""Servers beside a cell for programs by others: symbols, ADS, OPC UA."""
