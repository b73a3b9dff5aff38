"""The panel in a real browser: a phone's window, reloads, a second device, and the run going away."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from selenium.webdriver.common.by import By
from selenium.webdriver.remote.webdriver import WebDriver

from backends.diffdrive import DifferentialDrive, DifferentialDriveConfig
from sceann_hil.robot import EndReason
from sceann_hil.supervision.operators import ACCEPTED, Desk, Finished, Phase, Situation, Status, Verb
from sceann_hil.supervision.operators.web import WebPanel
from tests.supervision.operators.browsers import press, wait
from tests.supervision.operators.stations import desk_in

ARENA = DifferentialDrive(DifferentialDriveConfig(n_sensors=5)).drawing
START = (("x_m", 0.1), ("y_m", 0.12), ("heading_rad", 0.785))
WORDS = "Put the robot 10.0 cm from the left and 12.0 cm from the lower wall, heading 45° (0° is right, 90° is up)."
SITUATION = Situation(7, 12, 1, 0, WORDS, START)
STATUS = Status(
    run="goal reach",
    robot="remote (onboard)",
    robot_messages=("battery 7.61 V",),
    link_quality=0.998,
    battery_fraction=0.67,
    done=97,
    todo=200,
    generation=7,
    generations=50,
    robot_s=8130.0,
    wall_s=12_960.0,
    left=("robot time: 1:44:30 left",),
    forecast="budget ends in about 2:31:00, in 2:02:00 if every trial lasts to its step limit",
    remark="Controller c0ffee, not tried yet.",
)


class Asking:
    """The run's side in a thread: asks one question, or runs one trial, and keeps what came."""

    def __init__(self, desk: Desk, phase: Phase, situation: Situation = SITUATION) -> None:
        self.answers: list[str] = []
        self.interrupts: list[EndReason] = []
        self.over = threading.Event()
        self._desk, self._phase, self._situation = desk, phase, situation
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def _work(self) -> None:
        if self._phase is Phase.RUNNING:
            with self._desk.flight(self._situation, lambda reason: (self.interrupts.append(reason), self.over.set())):
                self.over.wait(20)
        else:
            self.answers.append(self._desk.ask(self._phase, self._situation).verb.value)

    def join(self) -> None:
        self._thread.join(20)
        assert not self._thread.is_alive()


@pytest.fixture
def desk() -> Desk:
    desk = Desk()
    desk.publish(STATUS, Finished("generation 7, individual 12, trial 0", "goal after 121 steps", 24.2, 0.395))
    return desk


@pytest.fixture
def panel(desk: Desk) -> Iterator[WebPanel]:
    with WebPanel(desk, "127.0.0.1", 0, ARENA) as panel:
        yield panel


def test_a_person_runs_a_trial_with_the_panel(browser: WebDriver, desk: Desk, panel: WebPanel, tmp_path: Path) -> None:
    before = Asking(desk, Phase.BEFORE)
    browser.get(panel.url)
    wait(browser, "document.body.dataset.phase === 'before'")
    assert "10.0 cm from the left" in browser.find_element(By.ID, "what").text
    assert wait(browser, "document.getElementById('pose').naturalWidth > 100")
    facts = browser.find_element(By.ID, "facts").text
    for told in (
        "97 of 200",
        "67 %",
        "robot time: 1:44:30 left",
        "budget ends in about",
        "battery 7.61 V",
        "99.8 % at the first try",
        "3 h 36 min",
    ):
        assert told in facts
    assert browser.find_element(By.ID, "remark").text == "Controller c0ffee, not tried yet."
    assert "goal after 121 steps" in browser.find_element(By.ID, "history").text
    press(browser, "ready")
    before.join()
    assert before.answers == ["ready"]

    running = Asking(desk, Phase.RUNNING)
    press(browser, "stop")
    running.join()
    assert running.interrupts == [EndReason.OPERATOR]

    after = Asking(desk, Phase.AFTER)
    press(browser, "discard")
    browser.find_element(By.ID, "text").send_keys("a wheel slipped")
    browser.find_element(By.CSS_SELECTOR, "#words button[value=ok]").click()
    after.join()
    assert after.answers == ["discard"]
    assert [said.text for said in desk.said() if said.verb is Verb.DISCARD] == ["a wheel slipped"]


def test_buttons_are_large_enough_for_a_thumb_and_nothing_sticks_out(
    browser: WebDriver, desk: Desk, panel: WebPanel
) -> None:
    asking = Asking(desk, Phase.BEFORE)
    browser.get(panel.url)
    wait(browser, "document.body.dataset.phase === 'before'")
    sizes = browser.execute_script(
        "return [...document.querySelectorAll('button[data-verb]')].map(b => b.getBoundingClientRect().height)"
    )
    assert min(sizes) >= 48
    assert browser.execute_script("return document.documentElement.scrollWidth <= window.innerWidth")
    press(browser, "ready")
    asking.join()


def test_a_reload_shows_the_same_and_its_answer_counts(browser: WebDriver, desk: Desk, panel: WebPanel) -> None:
    asking = Asking(desk, Phase.AFTER)
    browser.get(panel.url)
    wait(browser, "document.body.dataset.phase === 'after'")
    browser.refresh()
    wait(browser, "document.body.dataset.phase === 'after'")
    press(browser, "accept")
    asking.join()
    assert asking.answers == ["accept"]


def test_of_two_devices_the_first_answer_wins_and_the_other_sees_it(
    browser: WebDriver, open_browser: Callable[[], WebDriver], desk: Desk, panel: WebPanel
) -> None:
    other = open_browser()
    asking = Asking(desk, Phase.BEFORE)
    for device in (browser, other):
        device.get(panel.url)
        wait(device, "document.body.dataset.phase === 'before'")
    wait(other, "!document.getElementById('skip').disabled")
    # the second device's button is pressed although its page has not heard of the first one's answer yet
    question = other.execute_script("return Number(document.body.dataset.question)")
    press(browser, "ready")
    asking.join()
    status = other.execute_async_script(
        "const done = arguments[1]; fetch('/press', {method: 'POST', headers: {'Content-Type': 'application/json'}, "
        "body: JSON.stringify({verb: 'skip', question: arguments[0]})})"
        ".then(r => r.text().then(t => done([r.status, t])))",
        question,
    )
    assert status[0] == 409
    assert "web said ready" in status[1]
    assert asking.answers == ["ready"]
    wait(other, "document.getElementById('facts').textContent.includes('web: ready')")


def test_a_warning_is_a_banner_and_the_emergency_stop_is_always_there(
    browser: WebDriver, desk: Desk, panel: WebPanel
) -> None:
    browser.get(panel.url)
    wait(browser, "document.body.dataset.phase === 'idle'")
    desk.publish(Status(run="goal reach", warnings=("the robot drifts",)))
    wait(browser, "document.querySelector('#warnings .banner')?.textContent === 'the robot drifts'")
    press(browser, "emergency_stop")
    wait(browser, "document.body.dataset.phase === 'closed'")
    assert "emergency stop, pressed by web" in browser.find_element(By.ID, "what").text


def test_when_the_run_is_gone_the_page_says_so_and_offers_nothing(browser: WebDriver, desk: Desk) -> None:
    panel = WebPanel(desk, "127.0.0.1", 0, ARENA)
    asking = Asking(desk, Phase.BEFORE)
    with panel:
        browser.get(panel.url)
        wait(browser, "document.body.dataset.phase === 'before'")
    wait(browser, "!document.getElementById('offline').hidden")
    assert not browser.execute_script(
        "return [...document.querySelectorAll('button[data-verb]')].some(b => !b.disabled)"
    )
    assert asking.answers == []
    desk.press(Verb.READY, by="test", question=desk.view().question)
    asking.join()


def test_a_browser_that_goes_away_answers_nothing(browser: WebDriver, desk: Desk, panel: WebPanel) -> None:
    asking = Asking(desk, Phase.AFTER)
    browser.get(panel.url)
    wait(browser, "document.body.dataset.phase === 'after'")
    browser.get("about:blank")
    asking._thread.join(0.5)
    assert asking.answers == []
    desk.press(Verb.DISCARD, by="test", question=desk.view().question, text="nobody there")
    asking.join()


@pytest.mark.parametrize("phase", [phase for phase in Phase if phase is not Phase.CLOSED])
def test_the_page_offers_what_is_accepted_and_nothing_else(browser: WebDriver, phase: Phase) -> None:
    with desk_in(phase) as run, WebPanel(run.desk, "127.0.0.1", 0, ARENA) as panel:
        browser.get(panel.url)
        wait(browser, f"document.body.dataset.phase === '{phase.value}'")
        wait(browser, "[...document.querySelectorAll('button[data-verb]')].every(b => !b.disabled)")
        offered = browser.execute_script(
            "return [...document.querySelectorAll('button[data-verb]')].map(b => b.dataset.verb)"
        )
        assert sorted(offered) == sorted(verb.value for verb in ACCEPTED[phase])
