"""Configurations and trials for the tests of `backends.remote`."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np

from backends.cartpole import CartPole
from backends.remote import RemoteConfig, RemoteRobot
from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.link.vocabulary import EventCode
from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.controller import Dynamics
from sceann_hil.robot import EndReason, Results, Trials

SIZE = NetworkSize(2, 3, 1)


def hil_robot(port: object, reconnect_s: float = 5.0) -> str:
    """The ``robot`` section of a hardware-in-the-loop cart-pole as one YAML flow mapping."""
    return (
        f"{{type: remote, port: {port}, mode: hil, body: {{type: cartpole, n_sensors: 2}}, reconnect_s: {reconnect_s}}}"
    )


def real_robot(virtual: VirtualPosix, port: object, mode: str = "onboard", reconnect_s: float = 5.0) -> str:
    """The ``robot`` section of the virtual cart-pole, which a rig puts back."""
    assert virtual.rig is not None
    return (
        f"{{type: remote, port: {port}, mode: {mode}, n_sensors: 2, n_motors: 1, tick_s: 0.02, bumper: fell, "
        f"start_fields: [x_m, velocity_m_s, angle_rad, angular_velocity_rad_s], rig: '{virtual.rig.address}', "
        f"reconnect_s: {reconnect_s}}}"
    )


def pole_run(robot: str, population: int = 6, generations: int = 2, max_steps: int = 60) -> str:
    """A small experiment."""
    return f"""
task: {{type: pole_balancing, max_steps: {max_steps}}}
robot: {robot}
controller: {{coding: sceann3, n_hidden: 3}}
algorithm: {{type: sga, population: {population}, generations: {generations}}}
"""


def pole_trials(n: int, max_steps: int, first_id: int = 1, seed: int = 0) -> Trials:
    """Random SCEANN3 controllers on the cart-pole."""
    rng = np.random.default_rng(seed)
    genomes = rng.integers(0, 2, (n, Coding.SCEANN3.genome_length(SIZE)), np.uint8)
    return Trials(
        size=SIZE,
        dynamics=Dynamics(),
        weights=Coding.SCEANN3.decode(genomes, SIZE),
        genome_index=np.arange(n, dtype=np.int32),
        starts=np.tile([[0.0, 0.0, 0.0175, 0.0]], (n, 1)),
        keys=rng.integers(0, 2**64, n, np.uint64),
        max_steps=max_steps,
        ids=np.arange(first_id, first_id + n),
    )


def virtual_config(virtual: VirtualPosix, mode: str, **more: object) -> RemoteConfig:
    """How a host sees the virtual cart-pole."""
    return RemoteConfig.model_validate_json(
        json.dumps(
            {
                "port": virtual.port,
                "mode": mode,
                "n_sensors": 2,
                "n_motors": 1,
                "tick_s": 0.02,
                "start_fields": CartPole().spec.start_fields,
                "rig": virtual.rig.address if virtual.rig is not None else None,
                "bumper": "fell",
                "reconnect_s": 5.0,
                **more,
            }
        )
    )


def counted(robot: RemoteRobot, trial: Trials, attempts: int = 8) -> Results:
    """A trial in real time in which no tick came late; on a busy machine it takes more than one attempt."""
    for attempt in range(attempts):
        known = list(robot.link.events)
        results = robot.run(replace(trial, ids=trial.ids + 1000 * attempt))
        late = [
            event
            for event in list(robot.link.events)[len(known) :]
            if event.code in (EventCode.OVERRUN, EventCode.TICK_MISMATCH)
        ]
        if not EndReason(results.end_reasons[0]).is_void and not late:
            return results
    raise TimeoutError(f"this machine is too busy for a trial in real time: {attempts} attempts were late")
