"""The host's side of the robot link (``docs/link.md``), on any python-can bus.

`messages`: what is said. `serial_bus`: a serial port as a CAN bus. `line`: messages and heartbeats. `session`: requests
and the handshake. `upload`: a network into the robot. `trial`: what the control modes share; `onboard`, `tethered`,
`hil`: one trial in each. `statistics`: losses, latency and lateness. Numbers, frames and the descriptor, which
firmware tools need too, are in `sceann_hil.firmware`.
"""
