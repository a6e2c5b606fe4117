"""Pages with charts in Chromium: drawn, no errors, within narrow screens, under a strict policy."""

import shutil
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

from tests.chain import identified
from tests.workbench.report.test_chart import example
from workbench.report.chart import chart_assets, chart_html
from workbench.report.view import view

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
DRIVER = shutil.which("chromedriver")
pytestmark = pytest.mark.skipif(
    CHROMIUM is None or DRIVER is None,
    reason="no Chromium with chromedriver on PATH: pages are not looked at in a browser",
)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM or ""
    for one in ("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"):
        options.add_argument(one)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(DRIVER))
    yield driver
    driver.quit()


def opened(browser: Any, address: str, width: int) -> None:
    from selenium.webdriver.support.ui import WebDriverWait

    browser.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 600},
    )
    browser.get(address)
    undrawn = "return document.querySelectorAll('.chart:not([data-drawn])').length"
    WebDriverWait(browser, 30).until(lambda one: one.execute_script(undrawn) == 0)


def faults(browser: Any) -> list[str]:
    return [
        entry["message"]
        for entry in browser.get_log("browser")
        if "favicon" not in entry["message"]
    ]


def inked(browser: Any) -> list[int]:
    """Pixels of every canvas that are not blank."""
    return list(browser.execute_script(
        "return [...document.querySelectorAll('canvas')].map(c => c.getContext('2d')"
        ".getImageData(0, 0, c.width, c.height).data.filter((v, k) => k % 4 === 3 && v > 0).length)"
    ))  # fmt: skip


@pytest.mark.parametrize("width", [420, 1400])
def test_a_report_is_drawn_and_fits_the_screen(browser: Any, tmp_path: Path, width: int) -> None:
    (tmp_path / "report.html").write_text(view(identified()).page(), encoding="utf-8")
    opened(browser, (tmp_path / "report.html").as_uri(), width)
    assert faults(browser) == []
    found = inked(browser)
    assert found and min(found) > 1000
    assert browser.execute_script("return document.documentElement.scrollWidth") == width


class Strict(SimpleHTTPRequestHandler):
    """Files under a policy that allows no inline script and no inline style."""

    def end_headers(self) -> None:
        self.send_header("Content-Security-Policy", "default-src 'self'")
        super().end_headers()

    def log_message(self, format: str, *args: Any) -> None:
        pass


def test_a_chart_is_drawn_under_a_strict_policy_and_zooms(browser: Any, tmp_path: Path) -> None:
    for name, text in chart_assets().items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "index.html").write_text(
        "<!DOCTYPE html><html><head><link rel='stylesheet' href='uPlot.min.css'>"
        f"<link rel='stylesheet' href='chart.css'></head><body>{chart_html(example())}"
        "<script src='uPlot.iife.min.js'></script><script src='chart.js'></script></body></html>",
        encoding="utf-8",
    )
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Strict, directory=str(tmp_path)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        opened(browser, f"http://127.0.0.1:{server.server_port}/", 900)
        assert faults(browser) == []
        assert min(inked(browser)) > 1000
        before = inked(browser)
        browser.execute_script("document.querySelector('.chart-tools button').click()")
        assert browser.execute_async_script(
            "const done = arguments[0];"
            "requestAnimationFrame(() => requestAnimationFrame(() => done(1)))"
        )
        assert inked(browser) != before
    finally:
        server.shutdown()
        server.server_close()
