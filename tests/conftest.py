"""What all tests share: where things are, and what a missing tool means."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared"
BROWSER_OPTIONS = (
    "--headless=new --no-sandbox --disable-gpu --disable-quic --no-first-run "
    "--disable-background-networking --disable-component-update --disable-sync"
).split()


def skip_or_fail(reason: str) -> None:
    """On a user's machine a missing tool skips; in CI it is a failure."""
    if os.environ.get("CI"):
        pytest.fail(reason)
    pytest.skip(reason)


@pytest.fixture
def tool():
    """``tool("arm-none-eabi-gcc")``: the path of a program that this test cannot do without."""

    def find(name: str) -> str:
        path = shutil.which(name)
        if path is None:
            skip_or_fail(f"{name} is not installed (make test installs it where apt may)")
        return str(path)

    return find


@pytest.fixture
def shared():
    """The folder beside the checkout with real recordings and labelled gap cases."""
    if not SHARED.is_dir():
        skip_or_fail(f"{SHARED} is not there: the real recordings are not part of this repository")
    return SHARED


@pytest.fixture(scope="session")
def browser():
    """A headless Chromium (selenium's driver) that keeps its console's messages."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    if not (shutil.which("chromium") and shutil.which("chromedriver")):
        skip_or_fail("chromium and chromedriver are not installed")
    options = webdriver.ChromeOptions()
    for option in BROWSER_OPTIONS:
        options.add_argument(option)
    options.binary_location = str(shutil.which("chromium"))
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))
    yield driver
    driver.quit()
