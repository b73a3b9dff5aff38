"""Every algorithm that is shipped, and those of the guide, pass the kit."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from sceann_hil import registry
from sceann_hil.evolution import MapElitesConfig, OGAConfig, RandomSearchConfig, SGAConfig
from sceann_hil.evolution.map_elites import Axis
from sceann_hil.plugins import AlgorithmConfig
from sceann_hil.registry import Group
from sceann_hil.testing import AlgorithmConformance
from tests.runs import POLE, config_of, contents, evolve

PAGE = (Path(__file__).parents[2] / "docs" / "adding-an-algorithm.md").read_text(encoding="utf-8")


def _modules() -> list[ModuleType]:
    modules = []
    for number, block in enumerate(re.findall(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)[:2]):
        module = sys.modules[f"of_the_guide_{number}"] = ModuleType(f"of_the_guide_{number}")
        exec(compile(block, "docs/adding-an-algorithm.md", "exec"), module.__dict__)
        modules.append(module)
    return modules


CLIMBERS, PBIL = _modules()


class TestSGA(AlgorithmConformance):
    def config(self) -> AlgorithmConfig:
        return SGAConfig()


class TestOGA(AlgorithmConformance):
    def config(self) -> AlgorithmConfig:
        return OGAConfig()


class TestRandomSearch(AlgorithmConformance):
    def config(self) -> AlgorithmConfig:
        return RandomSearchConfig()


class TestTheGuidesAlgorithm(AlgorithmConformance):
    def config(self) -> AlgorithmConfig:
        config: AlgorithmConfig = CLIMBERS.ClimbersConfig()
        return config


class TestTheGuidesWrappedLibrary(AlgorithmConformance):
    def config(self) -> AlgorithmConfig:
        config: AlgorithmConfig = PBIL.PbilConfig()
        return config


class TestMapElites(AlgorithmConformance):
    def config(self) -> AlgorithmConfig:
        return MapElitesConfig(
            axes=(Axis(measure="one", range=(0.2, 0.8), cells=5), Axis(measure="other", range=(0.2, 0.8), cells=4))
        )


def test_every_shipped_algorithm_is_tried_here() -> None:
    tried = {kind().config().type for kind in AlgorithmConformance.__subclasses__() if kind.__module__ == __name__}
    # a transfer is of one experiment and chooses among its candidates: tests/run/transfer
    assert set(registry.available(Group.ALGORITHMS)) - {"transfer"} <= tried


@pytest.fixture
def guide(monkeypatch: pytest.MonkeyPatch) -> None:
    """The guide's algorithms, as if their package were installed."""
    kinds = {"climbers": CLIMBERS.ClimbersConfig, "pbil": PBIL.PbilConfig}
    available, load = registry.available, registry.load

    def with_guides(group: Group) -> dict[str, Any]:
        found: dict[str, Any] = dict(available(group))
        return found | kinds if group is Group.ALGORITHMS else found

    monkeypatch.setattr(registry, "available", with_guides)
    monkeypatch.setattr(registry, "load", lambda group, name: kinds[name] if name in kinds else load(group, name))


@pytest.mark.usefixtures("guide")
@pytest.mark.parametrize("kind", ["climbers", "pbil", "random"])
def test_a_run_evolves_with_it_and_is_the_same_run_again(kind: str, tmp_path: Path) -> None:
    setting = f"algorithm={{type: {kind}, population: 6, generations: 3}}"
    for name in ("one", "same"):
        evolve(tmp_path / name, POLE, setting)
    assert contents(tmp_path / "one") == contents(tmp_path / "same")
    assert config_of(POLE, setting).algorithm.type == kind
