"""ADS: the documented AMS/ADS frames over TCP, for tools made for TwinCAT."""
