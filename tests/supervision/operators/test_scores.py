"""A person says how good a trial was, 0 to 9, at the console, on the page and in a script: it is its fitness."""

from __future__ import annotations

import os
import pty
from contextlib import closing
from pathlib import Path

import pytest
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.remote.webdriver import WebDriver

from sceann_hil.errors import ConfigError
from sceann_hil.journal import JournalReader
from sceann_hil.run.experiment import Outcome
from sceann_hil.supervision.operators import Desk, Phase, Situation, Verb, console
from sceann_hil.supervision.operators.console import Console
from sceann_hil.supervision.operators.terminal_keys import TerminalKeys
from sceann_hil.supervision.operators.web import WebPanel
from tests.runs import GOAL, config_of
from tests.supervision.operators.browsers import wait
from tests.supervision.operators.fakes import attended_run
from tests.supervision.operators.stations import until
from tests.supervision.operators.test_browser import Asking

SCORED = Situation(0, 1, 0, 0, "Put it there.", score_by_operator=True)
JUDGED = ("task.score_by_operator=true", 'operator={"who": ["script"]}', "task.headings_deg=[0]")


def test_scores_become_fitness_and_stay_in_the_journal(tmp_path: Path) -> None:
    script = ["ready", "accept 7", "ready", "accept 0", "ready", "accept 9", "ready", "redo", "ready", "accept 4"]
    outcome, _ = attended_run(tmp_path / "r", script, *JUDGED, "task.success_score=7")
    assert outcome is Outcome.FINISHED
    with closing(JournalReader(tmp_path / "r")) as reader:
        rows = [row for generation in reader.generations() for row in reader.attempts(generation.number)]
        said = [(row.value, row.fitness) for row in rows]
        assert said == [
            (7.0, pytest.approx(7 / 9)),
            (0.0, 0.0),
            (9.0, 1.0),
            (None, None),
            (4.0, pytest.approx(4 / 9)),
        ]
        assert [generation.success_rate for generation in reader.generations()] == [0.5, 0.5]


def test_a_trial_without_a_score_does_not_count(tmp_path: Path) -> None:
    outcome, _ = attended_run(tmp_path / "r", ["ready", "accept"], *JUDGED)
    assert outcome is Outcome.FINISHED_BY_OPERATOR
    with closing(JournalReader(tmp_path / "r")) as reader:
        assert [row.fitness for row in reader.attempts(0)] == [None]


@pytest.mark.parametrize("text", ["", "10", "-1", "x", "5.5", "٣"])
def test_nothing_else_is_a_score(text: str) -> None:
    desk = Desk()
    asking = Asking(desk, Phase.AFTER, SCORED)
    assert until(lambda: desk.view().phase is Phase.AFTER)
    receipt = desk.press(Verb.ACCEPT, by="test", question=1, text=text)
    assert (receipt.accepted, receipt.message) == (False, "accept: say how good it was, 0 to 9")
    desk.press(Verb.ACCEPT, by="test", question=1, text="3")
    asking.join()


@pytest.mark.parametrize("changes", [{"who": ["none"]}, {"who": ["console"], "confirm": False}])
def test_somebody_must_be_there_to_say_it(changes: dict[str, object]) -> None:
    overrides = [f"operator.{key}={str(value).lower()}" for key, value in changes.items()]
    with pytest.raises(ConfigError, match=r"score_by_operator"):
        config_of(GOAL, "task.score_by_operator=true", *overrides)


def test_a_digit_accepts_at_the_console(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(console, "QUIET_S", 0.0)
    desk = Desk()
    asking = Asking(desk, Phase.AFTER, SCORED)
    terminal, line = pty.openpty()
    shown: list[str] = []
    with Console(desk, TerminalKeys(line), shown.append):
        assert until(lambda: bool(shown))
        assert "[0]-[9] accept" in shown[0]
        os.write(terminal, b"a")
        assert until(lambda: any("0 to 9" in text for text in shown[1:]))
        os.write(terminal, b"8")
        asking.join()
    assert [(press.verb, press.text) for press in desk.said()] == [(Verb.ACCEPT, "8")]
    os.close(line)
    os.close(terminal)


@pytest.mark.parametrize("way", ["finger", "key"])
def test_a_digit_accepts_on_the_page(browser: WebDriver, way: str) -> None:
    desk = Desk()
    with WebPanel(desk, "127.0.0.1", 0) as panel:
        asking = Asking(desk, Phase.AFTER, SCORED)
        browser.get(panel.url)
        wait(browser, "document.getElementById('score6') && !document.getElementById('score6').disabled")
        assert browser.find_elements(By.ID, "accept") == []
        heights = "return [...document.querySelectorAll('.scores button')].map(b => b.getBoundingClientRect().height)"
        assert min(browser.execute_script(heights)) >= 48
        if way == "finger":
            browser.find_element(By.ID, "score6").click()
        else:
            ActionChains(browser).send_keys("6").perform()
        asking.join()
    assert [(press.verb, press.text) for press in desk.said()] == [(Verb.ACCEPT, "6")]
