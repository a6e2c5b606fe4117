"""Chromium of the system as a person uses it: looks, clicks, keys, and an axe for accessibility."""

import os
import re
import shutil
from pathlib import Path
from typing import Any

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
DRIVER = shutil.which("chromedriver")
NO_BROWSER = "no Chromium with chromedriver on PATH: the page is not clicked through"
WIDE, NARROW = 1400, 420
PATIENCE = 300.0  # s that a person waits for a computation on a busy machine
AXE = Path(__file__).parent / "axe" / "axe.min.js"
EXPECTED = re.compile("status of 4|Status Error Code 4")  # refusals that the story asks for
SERIOUS = ("serious", "critical")


class Person:
    """Somebody in front of the page at `address`; pictures: a folder for what they see."""

    def __init__(self, address: str) -> None:
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service

        options = webdriver.ChromeOptions()
        options.binary_location = CHROMIUM or ""
        for one in ("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"):
            options.add_argument(one)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver: Any = webdriver.Chrome(options=options, service=Service(DRIVER))
        self.driver.set_script_timeout(60)
        self.address, self.width = address, WIDE
        self.wide()

    def wide(self, width: int = WIDE, *, dark: bool = False) -> None:
        """A window of that width, by day or in the dark."""
        self.width = width
        self._size(width, 1000)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [scheme]})

    def go(self, path: str) -> None:
        """Open a page."""
        self.driver.get(self.address + path)

    def find(self, selector: str) -> Any:
        """The element, as soon as it is there and seen."""
        return self.until(lambda: self._seen(selector), f"{selector} is not there")

    def until(self, true: Any, said: str, seconds: float = PATIENCE) -> Any:
        """What `true` gives as soon as it is something; fails with what is on the page."""
        from selenium.common.exceptions import TimeoutException
        from selenium.webdriver.support.ui import WebDriverWait

        try:
            return WebDriverWait(self.driver, seconds, 0.1).until(lambda _: true())
        except TimeoutException:
            raise AssertionError(f"{said}; the page says: {self.text()[-3000:]}") from None

    def reads(self, text: str) -> None:
        """Wait until the page says so."""
        self.until(lambda: text in self.text(), f"{text!r} is not said")

    def text(self) -> str:
        """What stands on the page."""
        return str(self.driver.execute_script("return document.body?.innerText ?? ''"))

    def type(self, selector: str, text: str) -> None:
        """Put a text into a field in place of what is there."""
        field = self.find(selector)
        field.clear()
        field.send_keys(text)

    def keys(self, *keys: str) -> None:
        """Press keys, wherever the focus is."""
        from selenium.webdriver import ActionChains

        ActionChains(self.driver).send_keys(*keys).perform()

    def focused(self) -> str:
        """What has the focus: its id, else its text."""
        return str(
            self.driver.execute_script(
                "const e = document.activeElement; return e.id || e.textContent.trim()"
            )
        )

    def tab_to(self, name: str, most: int = 80) -> None:
        """Press Tab until the element of that id or text has the focus, which has to be seen."""
        for _ in range(most):
            self.keys("\ue004")
            if self.focused() == name:
                shown = "return getComputedStyle(document.activeElement).outlineStyle"
                assert self.driver.execute_script(shown) != "none", f"{name}: no outline"
                return
        raise AssertionError(f"{name!r} is not reached by Tab")

    def drop(self, selector: str, name: str, content: str) -> None:
        """Drag a file over the element and let it fall."""
        self.driver.execute_script(
            "const [zone, name, text] = arguments, dt = new DataTransfer();"
            "dt.items.add(new File([text], name, {type: 'text/csv'}));"
            "for (const kind of ['dragenter', 'dragover', 'drop'])"
            "  zone.dispatchEvent(new DragEvent(kind,"
            "    {bubbles: true, cancelable: true, dataTransfer: dt}));",
            self.find(selector), name, content,
        )  # fmt: skip

    def inked(self, selector: str) -> bool:
        """Whether every chart below the element is drawn, and there is one."""
        return bool(self.driver.execute_script(
            "const all = [...document.querySelectorAll(arguments[0] + ' canvas')];"
            "return all.length > 0 && all.every(c => c.width > 0 && c.getContext('2d')"
            ".getImageData(0, 0, c.width, c.height).data.some((v, k) => k % 4 === 3 && v > 0))",
            selector,
        ))  # fmt: skip

    def looks_right(self, name: str) -> None:
        """No fault in the console, nothing wider than the window, no serious finding of axe."""
        faults = [
            entry["message"]
            for entry in self.driver.get_log("browser")
            if entry["level"] == "SEVERE" and not EXPECTED.search(entry["message"])
        ]
        assert not faults, f"{name}: {faults}"
        wide = self.driver.execute_script("return document.documentElement.scrollWidth")
        assert wide <= self.width, f"{name}: is {wide} wide"
        findings = self.axe()
        assert not findings, f"{name}: {findings}"
        folder = os.environ.get("WORKBENCH_SCREENSHOTS")
        if folder:
            self.picture(Path(folder) / f"{name}.png")

    def axe(self) -> list[str]:
        """Serious findings of axe, a line each."""
        self.driver.execute_script(AXE.read_text(encoding="utf-8"))
        found = self.driver.execute_async_script(
            "const done = arguments[0];"
            "axe.run(document, {resultTypes: ['violations']}).then(r => done(r.violations.map("
            "v => [v.impact, v.id, v.nodes.map(n => n.target.join(' ')).slice(0, 3).join(', ')])))"
        )
        return [f"{rule}: {where}" for impact, rule, where in found if impact in SERIOUS]

    def picture(self, path: Path) -> None:
        """The whole page as a picture."""
        path.parent.mkdir(parents=True, exist_ok=True)
        height = self.driver.execute_script("return document.documentElement.scrollHeight")
        self._size(self.width, min(height, 7000))
        self.driver.save_screenshot(str(path))
        self._size(self.width, 1000)

    def quit(self) -> None:
        """Close the browser."""
        self.driver.quit()

    def _seen(self, selector: str) -> Any:
        from selenium.webdriver.common.by import By

        found = self.driver.find_elements(By.CSS_SELECTOR, selector)
        return next((one for one in found if one.is_displayed()), None)

    def _size(self, width: int, height: int) -> None:
        self.driver.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride",
            {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600},
        )
