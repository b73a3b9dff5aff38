"""A view of the desk as the page gets it."""

from __future__ import annotations

import json
import math
from typing import Any

from sceann_hil.supervision.operators.keymap import KeyMap
from sceann_hil.supervision.operators.messages import View
from sceann_hil.supervision.operators.settings import Prompt
from sceann_hil.supervision.operators.verbs import Phase, Verb


def as_json(view: View, prompt: Prompt, keymap: KeyMap) -> str:
    """The document, in ASCII and without the numbers that JSON does not have."""
    return json.dumps(_finite(_document(view, prompt, keymap)), allow_nan=False)


def _document(view: View, prompt: Prompt, keymap: KeyMap) -> dict[str, Any]:
    status, situation = view.status, view.situation
    return {
        "version": view.version,
        "phase": view.phase.value,
        "question": view.question,
        "title": situation.title if situation else "",
        "instruction": situation.instruction if situation and view.phase is Phase.BEFORE else "",
        "outcome": situation.outcome if situation and view.phase is Phase.AFTER else "",
        "pose": f"/pose.svg?q={view.question}" if situation else "",
        "scored": situation is not None and situation.score_by_operator,
        "reason": view.reason,
        "accepts": [verb.value for verb in Verb if verb in view.accepts],
        "pausing": view.pausing,
        "finishing": view.finishing,
        "last": f"{view.last.by}: {view.last.verb.words}" if view.last else "",
        "run": status.run,
        "robot": status.robot,
        "robot_ok": status.robot_ok,
        "robot_messages": list(status.robot_messages),
        "link_quality": status.link_quality,
        "battery": status.battery_fraction,
        "done": status.done,
        "todo": status.todo,
        "generation": status.generation,
        "generations": status.generations,
        "robot_s": status.robot_s,
        "wall_s": status.wall_s,
        "left": list(status.left),
        "forecast": status.forecast,
        "best": status.best,
        "remark": status.remark,
        "warnings": list(status.warnings),
        "history": [
            {"title": f.title, "outcome": f.outcome, "duration_s": f.duration_s, "fitness": f.fitness}
            for f in view.history
        ],
        "prompt": prompt.value,
        "keys": keymap.as_document(),
        "verbs": {
            verb.value: {
                "label": verb.words,
                "means": verb.means,
                "key": keymap.name(verb),
                "answers": verb.is_answer,
                "wants_text": verb.wants_text,
            }
            for verb in Verb
        },
    }


def _finite(value: Any) -> Any:
    """The same with None for every number that is not finite: the page must never fail to read its document."""
    match value:
        case float():
            return value if math.isfinite(value) else None
        case dict():
            return {key: _finite(entry) for key, entry in value.items()}
        case list():
            return [_finite(entry) for entry in value]
        case _:
            return value
