"""Debian's Chromium, for whoever wants to look at the panel."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator

import pytest
from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.remote.webdriver import WebDriver


@pytest.fixture(scope="module")
def open_browser() -> Iterator[Callable[[], WebDriver]]:
    """Opens Debian's Chromium in the size of a phone."""
    chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if chromium is None or driver is None:
        pytest.skip("needs chromium and chromium-driver (tools/apt-packages.txt)")
    opened: list[WebDriver] = []

    def open_one() -> WebDriver:
        options = Options()
        options.binary_location = chromium
        for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"):
            options.add_argument(argument)
        options.add_argument("--window-size=412,915")
        opened.append(webdriver.Chrome(options=options, service=Service(driver)))
        return opened[-1]

    yield open_one
    for browser in opened:
        browser.quit()


@pytest.fixture(scope="module")
def browser(open_browser: Callable[[], WebDriver]) -> WebDriver:
    return open_browser()
