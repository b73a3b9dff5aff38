"""Random networks over codings, sizes and readings of the neuron, and the reference's states for all at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.controller import Dynamics, Neuron, sensors_to_q10, sigmoid
from sceann_hil.network.image import ControllerImage

MAX_NEURONS, MAX_SENSORS, MAX_SOURCES = 22, 12, 23


@dataclass(frozen=True)
class Case:
    """One network, its sensors and what the reference computes."""

    image: ControllerImage
    sensors: NDArray[np.uint16]
    states: NDArray[np.int16]
    motors: NDArray[np.int16]


def random_image(generator: np.random.Generator, largest: int = MAX_SOURCES) -> ControllerImage:
    """Any coding, reading, initial output, and size of at most `largest` sources that the link carries."""
    n_motors = int(generator.integers(1, 4))
    n_sensors = int(generator.integers(1, min(MAX_SENSORS, largest - n_motors) + 1))
    n_hidden = int(generator.integers(0, largest - n_motors - n_sensors + 1))
    size = NetworkSize(n_sensors, n_hidden, n_motors)
    coding = list(Coding)[generator.integers(3)]
    density = generator.uniform(0.1, 0.9)
    genome = (generator.random(coding.genome_length(size)) < density).astype(np.uint8)
    dynamics = Dynamics(list(Neuron)[generator.integers(2)], int(generator.choice([0, 512, 512, 512, 1024])))
    return ControllerImage(genome, coding, size, dynamics)


def random_sensors(generator: np.random.Generator, n_steps: int, n_sensors: int) -> NDArray[np.uint16]:
    """Slow drifts, noise and the extremes."""
    drift = np.cumsum(generator.integers(-40, 41, (n_steps, n_sensors)), axis=0) + generator.integers(
        0, 1024, n_sensors
    )
    values = np.abs(drift) % 2047
    values = np.where(values > 1023, 2046 - values, values)
    jump = generator.random((n_steps, n_sensors))
    values[jump < 0.02] = 0
    values[jump > 0.98] = 1023
    return values.astype(np.uint16)


def cases(seed: int, n_networks: int, n_steps: int) -> list[Case]:
    """Networks of the paper's sizes for the most part, every eighth of any size up to 23 sources; the rules of
    `sceann_hil.network.controller.Controller` for all networks side by side."""
    generator = np.random.default_rng(seed)
    images = [random_image(generator, MAX_SOURCES if k % 8 == 0 else 10) for k in range(n_networks)]
    weights = np.zeros((n_networks, MAX_NEURONS, MAX_SENSORS + MAX_NEURONS), np.int16)
    x = np.zeros((n_networks, MAX_NEURONS), np.int16)
    sensors = np.zeros((n_networks, n_steps, MAX_SENSORS), np.uint16)
    for k, image in enumerate(images):
        size = image.size
        weights[k, : size.n_neurons, : size.n_sensors] = image.weights[:, : size.n_sensors]
        weights[k, : size.n_neurons, MAX_SENSORS : MAX_SENSORS + size.n_neurons] = image.weights[:, size.n_sensors :]
        x[k] = image.dynamics.initial_output
        sensors[k, :, : size.n_sensors] = random_sensors(generator, n_steps, size.n_sensors)
    memoryless = np.array([image.dynamics.neuron is Neuron.MEMORYLESS for image in images])[:, None]
    u = np.zeros((n_networks, MAX_NEURONS), np.int16)
    states = np.empty((n_networks, n_steps, MAX_NEURONS), np.int16)
    outputs = np.empty_like(states)
    floats = weights.astype(np.float32)
    for step in range(n_steps):
        sources = np.concatenate([sensors_to_q10(sensors[:, step]), x], axis=1)
        net = np.einsum("kij,kj->ki", floats, sources.astype(np.float32), optimize=False).astype(np.int16)
        u = np.where(memoryless, net, u + net)
        reset = np.abs(u) > 8192
        u = np.where(reset, 0, u).astype(np.int16)
        x = np.where(memoryless & reset, 0, sigmoid(u)).astype(np.int16)
        states[:, step], outputs[:, step] = u, x
    return [
        Case(
            image,
            np.ascontiguousarray(sensors[k, :, : image.size.n_sensors]),
            np.ascontiguousarray(states[k, :, : image.size.n_neurons]),
            np.ascontiguousarray(outputs[k, :, image.size.n_hidden : image.size.n_neurons]),
        )
        for k, image in enumerate(images)
    ]
