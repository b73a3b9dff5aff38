"""Both stops are within reach in every state of the page: for a finger, for keys, for a screen reader."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.remote.webdriver import WebDriver

from sceann_hil.robot import EndReason
from sceann_hil.supervision.operators import ACCEPTED, Phase, Status, Verb
from sceann_hil.supervision.operators.web import WebPanel
from tests.supervision.operators.browsers import press, resize, wait
from tests.supervision.operators.stations import Run, desk_in, until

SIZES = [(320, 480), (412, 915), (844, 390), (1440, 900)]
STOPS = ["stop", "emergency_stop"]
OPEN_PHASES = [phase for phase in Phase if phase is not Phase.CLOSED]
STATES = [(phase, "") for phase in OPEN_PHASES] + [
    *((phase, "note") for phase in OPEN_PHASES),
    (Phase.AFTER, "discard"),
    (Phase.RUNNING, "warnings"),
    (Phase.RUNNING, "no connection"),
]
ON_TOP = """
const b = document.getElementById(arguments[0]).getBoundingClientRect();
const points = [[.5, .5], [.1, .2], [.9, .8]].map(([x, y]) => [b.left + x * b.width, b.top + y * b.height]);
return points.every(([x, y]) => document.elementFromPoint(x, y)?.closest('button')?.id === arguments[0])
  && !document.getElementById(arguments[0]).disabled && b.height >= 44
  && document.getElementById(arguments[0]).closest('[inert], [aria-hidden=true]') === null;
"""


@contextmanager
def page_in(browser: WebDriver, phase: Phase, what: str) -> Iterator[Run]:
    """The page with the desk in a phase, and a note being written, or whatever else can be in the way."""
    with desk_in(phase) as run, WebPanel(run.desk, "127.0.0.1", 0) as panel:
        browser.get(panel.url)
        wait(browser, f"document.body.dataset.phase === '{phase.value}'")
        if what in ("note", "discard"):
            press(browser, what)
            browser.find_element(By.ID, "text").send_keys("it says! a ")
        if what == "warnings":
            run.desk.publish(Status(run="r" * 80, warnings=tuple(f"warning {i} " * 20 for i in range(12))))
            wait(browser, "document.querySelectorAll('#warnings .banner').length === 12")
        if what == "no connection":
            browser.execute_script("offline('No connection')")
        yield run


@pytest.mark.parametrize(("phase", "what"), STATES)
def test_both_stops_lie_open_at_every_size(browser: WebDriver, phase: Phase, what: str) -> None:
    try:
        with page_in(browser, phase, what):
            for size in SIZES:
                resize(browser, *size)
                for y in ("0", "document.body.scrollHeight / 2", "document.body.scrollHeight"):
                    browser.execute_script(f"scrollTo(0, {y})")
                    for stop in STOPS:
                        assert browser.execute_script(ON_TOP, stop), (stop, size, y)
                assert browser.execute_script("return document.documentElement.scrollWidth <= innerWidth"), size
                if what in ("note", "discard"):
                    browser.execute_script("document.getElementById('text').scrollIntoView({block: 'nearest'})")
                    over = "const t = document.getElementById('text').getBoundingClientRect();"
                    over += "return document.elementFromPoint(t.left + 9, t.top + t.height / 2)?.id === 'text'"
                    assert browser.execute_script(over), "the stops lie over the words that are written"
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})  # type: ignore[attr-defined]


@pytest.mark.parametrize("way", ["finger", "key", "walk"])
@pytest.mark.parametrize("verb", [Verb.STOP, Verb.EMERGENCY_STOP])
@pytest.mark.parametrize(("phase", "what"), STATES)
def test_both_stops_stop(browser: WebDriver, phase: Phase, what: str, verb: Verb, way: str) -> None:
    with page_in(browser, phase, what) as run:
        if way == "finger":
            browser.find_element(By.ID, verb.value).click()
        elif way == "key":
            ActionChains(browser).send_keys(Keys.F8 if verb is Verb.STOP else Keys.F9).perform()
        else:
            _walk_to(browser, verb.value)
            ActionChains(browser).send_keys(Keys.ENTER).perform()
        if verb is Verb.EMERGENCY_STOP:
            assert until(lambda: run.desk.view().phase is Phase.CLOSED)
            assert run.interrupts == ([EndReason.EMERGENCY_STOP] if phase is Phase.RUNNING else [])
        elif verb in ACCEPTED[phase]:
            assert until(lambda: run.interrupts == [EndReason.OPERATOR])
        else:
            # whether there is something to stop is the run's to say, and it says so
            wait(browser, "document.getElementById('receipt').textContent.includes('not possible now')")
            assert run.desk.view().phase is phase


def _walk_to(browser: WebDriver, name: str) -> None:
    for _ in range(40):
        ActionChains(browser).send_keys(Keys.TAB).perform()
        if browser.execute_script("return document.activeElement.id") == name:
            return
    raise AssertionError(f"Tab never comes to {name}")


@pytest.mark.parametrize(("key", "reason"), [(" ", EndReason.OPERATOR), ("!", EndReason.EMERGENCY_STOP)])
def test_the_console_s_keys_stop_too_wherever_the_focus_is(browser: WebDriver, key: str, reason: EndReason) -> None:
    with page_in(browser, Phase.RUNNING, "") as run:
        browser.execute_script("document.getElementById('note').focus()")
        ActionChains(browser).send_keys(key).perform()
        assert until(lambda: run.interrupts == [reason])
        assert browser.execute_script("return document.getElementById('words').hidden")


def test_while_a_note_is_written_its_characters_are_characters(browser: WebDriver) -> None:
    with page_in(browser, Phase.RUNNING, "") as run:
        press(browser, "note")
        ActionChains(browser).send_keys("it slipped! Öl? a r").perform()
        ActionChains(browser).send_keys(Keys.ENTER).perform()
        wait(browser, "document.getElementById('receipt').textContent === 'note: taken'")
        assert [press.text for press in run.desk.said()] == ["it slipped! Öl? a r"]
        assert run.interrupts == []


def test_keys_are_the_console_s(browser: WebDriver) -> None:
    with page_in(browser, Phase.AFTER, "") as run:
        wait(browser, "!document.getElementById('accept').disabled")
        ActionChains(browser).send_keys("a").perform()
        assert until(lambda: run.ended == "accept")


def test_a_screen_reader_finds_both_stops_by_name(browser: WebDriver) -> None:
    with page_in(browser, Phase.RUNNING, "note"):
        browser.execute_cdp_cmd("Accessibility.enable", {})  # type: ignore[attr-defined]
        nodes = browser.execute_cdp_cmd("Accessibility.getFullAXTree", {})["nodes"]  # type: ignore[attr-defined]
        shown = [(n.get("role", {}).get("value"), n.get("name", {}).get("value")) for n in nodes if not n["ignored"]]
        assert ("region", "Stops") in shown
        assert ("button", "STOP this trial") in shown
        assert ("button", "EMERGENCY STOP") in shown
        assert ("textbox", "Note") in shown


def test_a_note_outlives_the_question_and_the_trial_it_was_begun_in(browser: WebDriver) -> None:
    with page_in(browser, Phase.AFTER, "note") as run:
        run.desk.press(Verb.ACCEPT, by="test", question=run.desk.view().question)
        wait(browser, "document.body.dataset.phase === 'idle'")
        assert browser.find_element(By.ID, "text").get_attribute("value") == "it says! a "
        browser.find_element(By.ID, "words_ok").click()
        wait(browser, "document.getElementById('receipt').textContent === 'note: taken'")
        assert [press.text for press in run.desk.said() if press.text] == ["it says! a"]


def test_what_was_typed_is_shown_as_text(browser: WebDriver) -> None:
    attack = "<img src=x onerror=document.title='bad'><script>document.title='bad'</script>"
    with page_in(browser, Phase.IDLE, "") as run:
        run.desk.publish(Status(run=attack, robot=attack, robot_messages=(attack,), warnings=(attack,), left=(attack,)))
        wait(browser, "document.querySelectorAll('#warnings .banner').length === 1")
        assert browser.find_element(By.CSS_SELECTOR, "#warnings .banner").text == attack
        assert browser.execute_script("return document.querySelectorAll('img[src=x]').length") == 0
        assert "bad'>" in browser.title
        assert browser.title != "bad"


def test_the_token_is_not_in_the_address_and_no_script_can_read_it(browser: WebDriver) -> None:
    with desk_in(Phase.IDLE) as run, WebPanel(run.desk, "127.0.0.1", 0) as panel:
        browser.get(panel.url)
        wait(browser, "document.body.dataset.phase === 'idle'")
        assert browser.current_url == f"http://127.0.0.1:{panel.port}/"
        assert panel.access.token not in browser.page_source
        assert panel.access.token not in browser.execute_script("return document.cookie")
        assert panel.access.token not in str(
            browser.execute_script("return document.referrer + JSON.stringify(history)")
        )


def test_a_link_on_another_site_s_page_opens_the_panel_and_a_frame_does_not(browser: WebDriver) -> None:
    with desk_in(Phase.IDLE) as run, WebPanel(run.desk, "127.0.0.1", 0) as panel:
        browser.get("data:text/html,<a id=link>link</a><iframe id=frame></iframe>")
        browser.execute_script("document.getElementById('frame').src = arguments[0]", panel.url)
        browser.switch_to.frame("frame")
        assert until(lambda: "Stops" not in browser.page_source)
        assert browser.find_elements(By.ID, "emergency_stop") == []
        browser.switch_to.default_content()
        browser.execute_script("document.getElementById('link').href = arguments[0]", panel.url)
        browser.find_element(By.ID, "link").click()
        wait(browser, "document.body.dataset.phase === 'idle'")


def test_a_run_that_was_started_again_says_that_the_link_is_a_new_one(browser: WebDriver) -> None:
    with desk_in(Phase.IDLE) as run:
        with WebPanel(run.desk, "127.0.0.1", 0) as panel:
            browser.get(panel.url)
            wait(browser, "document.body.dataset.phase === 'idle'")
        with WebPanel(run.desk, "127.0.0.1", panel.port):
            wait(browser, "document.getElementById('offline').textContent.includes('link is not valid any more')")
