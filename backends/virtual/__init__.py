"""Virtual robots: emulated boards with a simulated body on their pins (``sceann virtual``)."""
