"""No module draws from hidden random state: a Generator is always passed."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import backends
import sceann_hil

PACKAGES = [Path(package.__path__[0]) for package in (sceann_hil, backends)]
EXPLICIT = {"BitGenerator", "Generator", "PCG64", "Philox", "SeedSequence", "default_rng"}
"""What numpy.random has without hidden state, as long as default_rng gets a seed."""


def global_randomness(source: str) -> list[str]:
    """The expressions and imports of `source` that use random state nobody passed."""
    found = []
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Import(names=names):
                found += [a.name for a in names if a.name in {"random", "numpy.random"}]
            case ast.ImportFrom(module="random", level=0):
                found.append("random")
            case ast.ImportFrom(module="numpy.random", names=names):
                found += [a.name for a in names if a.name not in EXPLICIT]
            case ast.Attribute(value=ast.Attribute(value=ast.Name(id="np" | "numpy"), attr="random"), attr=name):
                if name not in EXPLICIT:
                    found.append(ast.unparse(node))
            case ast.Call(func=function, args=[], keywords=[]):
                if ast.unparse(function).endswith(("default_rng", "SeedSequence", "PCG64", "Philox")):
                    found.append(ast.unparse(node))
    return found


@pytest.mark.parametrize(
    "source",
    [
        "import random",
        "from random import choice",
        "import numpy.random",
        "from numpy.random import rand",
        "np.random.seed(1)",
        "x = numpy.random.normal(size=3)",
        "rng = np.random.default_rng()",
        "np.random.Generator(np.random.PCG64())",
    ],
)
def test_hidden_random_state_is_found(source: str) -> None:
    assert global_randomness(source)


def test_explicit_generators_are_not_mistaken_for_it() -> None:
    assert not global_randomness("def f(rng: np.random.Generator): return np.random.default_rng(3).random()")


@pytest.mark.parametrize("package", PACKAGES, ids=lambda path: path.name)
def test_no_module_uses_hidden_random_state(package: Path) -> None:
    # the kit for algorithms turns hidden random state on purpose, to see whether an algorithm minds
    modules = [path for path in sorted(package.rglob("*.py")) if path.parts[-2:] != ("testing", "algorithms.py")]
    assert modules
    found = {str(path): hits for path in modules if (hits := global_randomness(path.read_text("utf-8")))}
    assert not found
