"""Chromium without a window, and axe-core, the judge of accessibility, in it."""

import os
import shutil
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def axe():
    """The script of axe-core, which nox --session pages fetches."""
    return Path(os.environ["MEMSCAL_AXE"]).read_text(encoding="utf-8")


@pytest.fixture(scope="session")
def browser():
    from playwright.sync_api import sync_playwright

    program = shutil.which("chromium")
    assert program, "Chromium is not installed: apt-get install chromium"
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield started
        started.close()


@pytest.fixture
def opened(browser):
    """Open a page; what it asks for beside itself and says on the console are errors."""
    heard = []
    contexts = []

    def open_(path, **options):
        contexts.append(browser.new_context(**options))
        page = contexts[-1].new_page()
        page.on("console", lambda message: heard.append(message.text))
        page.on("pageerror", lambda error: heard.append(str(error)))
        page.on("request", lambda request: heard.append(request.url[:200]))
        page.goto(path.as_uri())
        return page

    yield open_
    for context in contexts:
        context.close()
    assert [text for text in heard if not text.startswith(("file:", "data:"))] == []
    assert len([text for text in heard if text.startswith("file:")]) == len(contexts)
