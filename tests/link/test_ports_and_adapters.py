"""Ports and CAN adapters that cannot be opened: one message each, with the driver's own words."""

from __future__ import annotations

import os
import pty
import termios
from pathlib import Path

import can
import pytest
from serial.tools.list_ports_common import ListPortInfo

from backends.remote import RemoteConfig
from sceann_hil.errors import FlashFailed
from sceann_hil.firmware.flash import opened
from sceann_hil.link import can_bus, ports
from sceann_hil.link.can_bus import AdapterProblem, known_interfaces, open_can
from sceann_hil.link.serial_bus import SceannSerialBus
from sceann_hil.robot import LinkError


@pytest.mark.parametrize("interface", sorted({*known_interfaces()} - {"virtual", "udp_multicast"}))
def test_every_interface_that_is_not_here_fails_with_one_kind_of_error(interface: str) -> None:
    """Each has exceptions of its own: OSError, ImportError, AttributeError, TypeError, ..."""
    with pytest.raises(AdapterProblem, match=f"CAN {interface}:no such channel: "):
        open_can(interface, "no such channel", 500_000).shutdown()


@pytest.mark.parametrize("error", [AttributeError("no dll"), ImportError("no package"), TypeError(), KeyError("x")])
def test_whatever_a_driver_raises_is_a_robot_that_cannot_be_reached(
    monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    def fail(*_: object, **__: object) -> can.BusABC:
        raise error

    monkeypatch.setattr(can_bus.can, "Bus", fail)
    config = RemoteConfig.model_validate(
        {
            **{"can": {"interface": "pcan", "channel": "PCAN_USBBUS1"}, "mode": "hil", "reconnect_s": 0.1},
            "body": {"type": "cartpole", "n_sensors": 2},
        }
    )
    with pytest.raises(LinkError, match="CAN pcan:PCAN_USBBUS1"), config.build():
        pass


def test_an_interface_that_python_can_does_not_know_is_a_wrong_configuration() -> None:
    with pytest.raises(ValueError, match="expected one of"):
        RemoteConfig.model_validate({"can": {"interface": "pigeon", "channel": "0"}, "mode": "hil"})


class TestPorts:
    def test_a_busy_port_is_not_a_bad_cable(self) -> None:
        near, far = pty.openpty()
        port = os.ttyname(far)
        first = SceannSerialBus(port)
        with pytest.raises(FlashFailed) as failed, opened(port):
            pass
        assert "another program has this port open" in failed.value.message
        assert "cable" not in str(failed.value)
        first.shutdown()
        os.close(near)
        os.close(far)

    def test_a_file_is_no_port(self, tmp_path: Path) -> None:
        file = tmp_path / "notes.txt"
        file.write_text("hello")
        with pytest.raises(FlashFailed, match="no serial port"), opened(str(file)):
            pass
        assert file.read_text() == "hello"

    def test_a_port_that_is_not_there(self) -> None:
        with pytest.raises(FlashFailed, match="there is no such port"), opened("/dev/ttyNONE"):
            pass

    def test_built_in_ports_are_not_tried_by_themselves(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Regression: `flash` without --port tried /dev/ttyS0, which every computer has and nothing hangs on."""
        built_in, plugged = ListPortInfo("/dev/ttyS0"), ListPortInfo("/dev/ttyACM0")
        plugged.vid = 0x2341
        monkeypatch.setattr(ports.list_ports, "comports", lambda **_: [built_in])
        with pytest.raises(FlashFailed, match="which one"):
            ports.the_only_port()
        monkeypatch.setattr(ports.list_ports, "comports", lambda **_: [built_in, plugged])
        assert ports.the_only_port() == "/dev/ttyACM0"

    def test_closing_leaves_dtr_as_it_is(self) -> None:
        near, far = pty.openpty()
        bus = SceannSerialBus(os.ttyname(far))
        assert not termios.tcgetattr(near)[2] & termios.HUPCL
        bus.shutdown()
        os.close(near)
        os.close(far)
