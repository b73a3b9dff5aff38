"""What tests do with a real browser."""

from __future__ import annotations

from selenium.webdriver.common.by import By
from selenium.webdriver.remote.webdriver import WebDriver
from selenium.webdriver.support.ui import WebDriverWait


def wait(browser: WebDriver, script: str) -> object:
    """Until a script gives something true."""
    return WebDriverWait(browser, 20, poll_frequency=0.05).until(lambda b: b.execute_script(f"return {script}"))


def press(browser: WebDriver, verb: str) -> None:
    wait(browser, f"document.getElementById('{verb}') && !document.getElementById('{verb}').disabled")
    browser.find_element(By.ID, verb).click()


def resize(browser: WebDriver, width: int, height: int, *, mobile: bool = False) -> None:
    """The page's window, in CSS pixels; narrower than a desktop's window can be."""
    metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": mobile}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)  # type: ignore[attr-defined]
