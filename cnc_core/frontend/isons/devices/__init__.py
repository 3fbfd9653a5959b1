"""Devices that IsoNs programs speak to: CANopen, clock, homing, positioners."""
