"""The page of `crossfield studio`, served by its command, and documents for it."""

from __future__ import annotations

import http.client
import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from urllib.parse import urlsplit

PEBBLE = {
    "format": "crossfield-studio",
    "version": 1,
    "name": "pebble",
    "page": [0, 0, 120, 100],
    "strokes": [
        {"points": [10, 10, 110, 10, 110, 90, 10, 90, 10, 10], "mark": "cut", "weight": 1},
        {"points": [10, 40, 60, 55, 110, 40], "mark": "line", "weight": 1},
        {"points": [60, 10, 55, 50, 60, 90], "mark": "line", "weight": 1},
    ],
    "mask": [],
    "hints": [],
    "flip": False,
    "size": 16,
    "stroke_weight": 20,
    "silhouette": "none",
}
"""A box with two curvature lines."""
CROSSED = [
    PEBBLE["strokes"][0],
    *({"points": [10, y, 110, y], "mark": "line", "weight": 1} for y in (30, 50, 70)),
    *({"points": [x, 10, x, 90], "mark": "line", "weight": 1} for x in (35, 60, 85)),
    {"points": [25, 20, 95, 83], "mark": "line", "weight": 1},
]
"""A net of curvature lines, and a stroke aslant over it, which crosses lines of both families."""


def changed(**parts) -> bytes:
    """The document of the pebble with other parts, as JSON."""
    return json.dumps(PEBBLE | parts).encode()


@dataclass(frozen=True)
class Studio:
    """A page that is served. process: its server."""

    address: str
    process: subprocess.Popen[str]

    @property
    def host(self) -> str:
        return urlsplit(self.address).netloc

    def ask(self, path, data=None, *, method=None, headers=None):
        """Status, headers and body of an answer. path: below the token, unless it begins with a slash."""
        connection = http.client.HTTPConnection(self.host, timeout=60)
        whole = path if path.startswith("/") else urlsplit(self.address).path + path
        method = method or ("GET" if data is None else "POST")
        own = {"Host": self.host} | ({} if method == "GET" else {"Origin": f"http://{self.host}"})
        try:
            connection.request(method, whole, data, {k: v for k, v in (own | (headers or {})).items() if v})
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read()
        finally:
            connection.close()

    def steps(self, path, data):
        """The lines of JSON of an answer."""
        status, _, body = self.ask(path, data)
        assert status == 200, body
        return [json.loads(line) for line in body.splitlines()]

    def stop(self) -> int:
        """End the server as Ctrl-C does, and return its exit code."""
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(30)


@contextmanager
def studio(*arguments: str) -> Iterator[Studio]:
    """The page of `crossfield studio` with these arguments, while the block runs."""
    command = [sys.executable, "-m", "crossfield", "studio", "--no-browser", *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        address = process.stdout.readline().strip()
        assert address, process.stderr and process.stderr.read()
        try:
            yield Studio(address, process)
        finally:
            process.kill()
