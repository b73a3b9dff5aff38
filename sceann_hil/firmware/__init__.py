"""From an evolved genome to a microcontroller: C header, firmware image, upload, proof.

* `image`: the one controller that everything here takes, and its genome record.
* `header`: the self-contained C header of ``sceann export``.
* `build`: the firmware of each board, compiled and kept.
* `vocabulary`, `framing`, `descriptor`: numbers, serial frames and self-description of the link.
* `client`: a host's side of the link, as small as flashing and verifying need.
* `flash`: upload, and what is then on the robot.
* `verify`: the board against the reference, state by state.
"""
