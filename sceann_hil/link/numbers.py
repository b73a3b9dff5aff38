"""The numbers of link and firmware, made from ``firmware/numbers.toml`` by tools/generate_link. Do not edit."""

LINK_VERSION = 2
FIRMWARE_VERSION = (0, 2, 0)

HEARTBEAT_S = 0.1
"""Time between two heartbeats, of host and robot."""
HOST_DEADLINE_S = 0.3
"""Time without a heartbeat of the session while ARMED or RUNNING: SAFE."""
SESSION_S = 1
"""Time that a silent host keeps its robot."""
AUTORUN_S = 3
"""Time after the start without a host: autorun."""
BATTERY_LOW_S = 0.15
"""Time that the battery is low, until the trial ends."""
WATCHDOG_S = 0.5
"""Time without a control tick, until the chip is restarted."""
BREAK_S = 0.001
"""Time that the line is low, until it is an emergency stop."""

OVERRUN_LIMIT = 3
MAX_SENSORS = 12
MAX_MOTORS = 3
MAX_SOURCES = 23
SENSORS_PER_PAGE = 6
CHUNK_BYTES = 7
STORE_BYTES = 956
