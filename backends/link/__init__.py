"""The host's side of the robot link (``docs/link.md``), on any python-can bus.

`messages`: what is said. `framing`, `serial_bus`: a serial port as a CAN bus. `session`: requests, heartbeats,
handshake. `upload`: a network into the robot. `trial`: one trial in each of the three control modes. `statistics`:
losses and latency.
"""
