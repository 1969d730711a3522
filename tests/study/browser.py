"""A headless Chromium, asked by its debugging pipe: what does a page request, and what does it log?"""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
# The browser reads commands from descriptor 3 and answers on 4.
START = """
import os, sys
from fcntl import F_DUPFD, fcntl
away = [fcntl(int(one), F_DUPFD, 10) for one in sys.argv[1:3]]
for number, one in enumerate(away):
    os.dup2(one, 3 + number)
os.execv(sys.argv[3], sys.argv[3:])
"""


def executable() -> str | None:
    """The browser, if there is one."""
    return next((found for name in NAMES if (found := shutil.which(name))), None)


def _ask(browser: str, profile: Path) -> tuple[subprocess.Popen, Any, Any]:
    """The browser, with a file to write commands to and one to read what it says."""
    to_browser, from_browser = os.pipe(), os.pipe()
    options = (
        "--headless=new --no-sandbox --disable-gpu --no-first-run --disable-background-networking "
        "--disable-component-update --remote-debugging-pipe"
    )
    ends = str(to_browser[0]), str(from_browser[1])
    process = subprocess.Popen(
        [
            sys.executable,
            "-S",
            "-c",
            START,
            *ends,
            browser,
            *options.split(),
            f"--user-data-dir={profile}",
        ],
        pass_fds=(to_browser[0], from_browser[1]),
        stderr=subprocess.DEVNULL,
    )
    os.close(to_browser[0])
    os.close(from_browser[1])
    return process, os.fdopen(to_browser[1], "wb", 0), os.fdopen(from_browser[0], "rb", 0)


def _messages(source: Any) -> Iterator[dict[str, Any]]:
    """Messages end with a zero byte."""
    kept = b""
    while chunk := source.read(65536):
        kept += chunk
        *whole, kept = kept.split(b"\0")
        yield from (json.loads(one) for one in whole)


def opened(
    page: Path, profile: Path, width: int = 1200, expression: str = "document.body.innerText"
) -> tuple[list[str], list[str], Any]:
    """URLs that a page of this width requested, what it complained of, and an expression's value."""
    process, write, read = _ask(executable(), profile)
    with process, write, read:
        said = _messages(read)
        number = 0

        def tell(method: str, session: str | None = None, **params: Any) -> dict[str, Any]:
            nonlocal number
            number += 1
            message = {"id": number, "method": method, "params": params}
            message |= {"sessionId": session} if session else {}
            write.write(json.dumps(message).encode() + b"\0")
            for one in said:
                seen.append(one)
                if one.get("id") == number:
                    return one["result"]
            raise AssertionError("the browser went away")

        seen: list[dict[str, Any]] = []
        target = tell("Target.createTarget", url="about:blank")["targetId"]
        session = tell("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Network", "Runtime", "Log"):
            tell(f"{domain}.enable", session)
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        tell("Emulation.setDeviceMetricsOverride", session, **size)
        tell("Page.navigate", session, url=page.as_uri())
        while not any(one.get("method") == "Page.loadEventFired" for one in seen):
            seen.append(next(said))
        told = tell("Runtime.evaluate", session, expression=expression, returnByValue=True)
        tell("Browser.close")
    requests = [
        one["params"]["request"]["url"]
        for one in seen
        if one.get("method") == "Network.requestWillBeSent"
    ]
    events = ("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded")
    complaints = [json.dumps(one["params"]) for one in seen if one.get("method") in events]
    return requests, complaints, told["result"]["value"]
