"""The server of the page: on this machine only, with a token in the address, for pages from itself only.

It stores no drawing: each request holds the whole document, and the answers are functions of it.
"""

from __future__ import annotations

import json
import secrets
import socket
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, wait
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from typing import Any, Final

import uvicorn
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response, StreamingResponse
from starlette.routing import Mount, Route
from starlette.types import ASGIApp, Receive, Scope, Send

from ...models.errors import CrossfieldError, InputError, NoStrokeError, shortened
from ...models.formulations.choice import list_formulations
from ...models.input_limits import MAX_BYTES
from ...models.processes.deadline import IsOver
from ...models.sketch.samples import SAMPLES, sample_svg
from ...templates import ENVIRONMENT
from ..formats.registry import FORMATS
from ..pictures.palette import ANGLES, DARK, LIGHT
from .desk import ClosedError, Desk
from .document import SIZES
from .files import DOWNLOADS, download
from .opening import open_drawing
from .session import OvertakenError
from .views import field_step, lines_step, next_step, surface_step

LOOPBACK: Final = "127.0.0.1"
COARSE: Final = 48  # pixels of the field that is shown before a finer one
_FINE: Final = 64  # pixels from which on there is a coarse field first
_TYPES: Final = {".css": "text/css", ".js": "text/javascript"}
_HEADERS: Final = {
    "content-security-policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "x-content-type-options": "nosniff",
    "referrer-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "cache-control": "no-store",
}


class Guard:
    """Refuses requests for another host, from another page, or without the token; adds safety headers."""

    def __init__(self, app: ASGIApp, port: int, token: str) -> None:
        self._app, self._token = app, token
        self._hosts = (f"{LOOPBACK}:{port}", f"localhost:{port}")

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it with 403."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if scope["type"] != "http":
            return
        if reason := self._refusal(Request(scope)):
            await PlainTextResponse(reason, 403, _HEADERS)(scope, receive, send)
            return

        async def with_headers(message: Any) -> None:
            if message["type"] == "http.response.start":
                message["headers"] += [(key.encode(), value.encode()) for key, value in _HEADERS.items()]
            await send(message)

        await self._app(scope, receive, with_headers)

    def _refusal(self, request: Request) -> str:
        host, origin = request.headers.get("host", ""), request.headers.get("origin")
        if host not in self._hosts:
            return "This server answers only on the machine where it runs."
        if origin is None and request.method not in {"GET", "HEAD"}:
            return "This request states no origin."
        elsewhere = request.headers.get("sec-fetch-site", "none") not in {"none", "same-origin"}
        if elsewhere or origin not in {None, f"http://{host}"}:
            return "This request comes from another page."
        token = request.url.path.split("/")[1]
        if not secrets.compare_digest(token.encode(), self._token.encode()):
            return (
                "This address belongs to an earlier server, or lacks the token of the running one. Use the "
                "address that `crossfield studio` printed. Pages of an earlier server can still save."
            )
        return ""


@dataclass(frozen=True)
class Page:
    """The routes of the page. first: the drawing that it opens with, as from `opened`, or None."""

    desk: Desk
    first: dict[str, Any] | None

    def routes(self) -> list[Route]:
        """All addresses below the token."""
        return [
            Route("/", self.index),
            Route("/alive", self.alive),
            Route("/first", self.start),
            Route("/sample/{name}", self.sample),
            Route("/open", self.open, methods=["POST"]),
            Route("/compute", self.compute, methods=["POST"]),
            Route("/next", self.next, methods=["POST"]),
            Route("/download", self.download, methods=["POST"]),
            Route("/{name}", self.file),
        ]

    async def index(self, _: Request) -> Response:
        """The page."""
        text = ENVIRONMENT.get_template("studio/index.html.j2").render(
            samples=[sample for sample in SAMPLES.values() if sample.kind == "sketch"],
            downloads={name: entry.title for name, entry in DOWNLOADS.items() if name != "solver"},
            formulations=list_formulations(),
            formats=list(FORMATS),
            sizes=SIZES,
            palette=json.dumps({"light": LIGHT, "dark": DARK, "angles": ANGLES}),
        )
        return Response(text, media_type="text/html")

    async def file(self, request: Request) -> Response:
        """A script or the style sheet."""
        name = request.path_params["name"]
        folder = Path(ENVIRONMENT.get_template("studio/index.html.j2").filename or "").parent
        files = {path.name: path for path in folder.iterdir() if path.suffix in _TYPES}
        if name not in files:
            return PlainTextResponse("There is no such file.", 404)
        return Response(files[name].read_bytes(), media_type=_TYPES[files[name].suffix])

    async def alive(self, _: Request) -> Response:
        """An answer at once, also while all processes compute."""
        return JSONResponse({})

    async def start(self, _: Request) -> Response:
        """The drawing that the page opens with."""
        return JSONResponse(self.first)

    async def sample(self, request: Request) -> Response:
        """The strokes of a built-in sketch."""
        name = request.path_params["name"]
        return await _answered(lambda: open_drawing(sample_svg(name).encode(), f"{name}.svg"))

    async def open(self, request: Request) -> Response:
        """The strokes of a file that the browser sends."""
        data = await _body(request)
        name, view = request.query_params.get("name", ""), request.query_params.get("view")
        return await _answered(lambda: open_drawing(data, name[:200], view))

    async def compute(self, request: Request) -> Response:
        """Field, streamlines and surface of a document, as lines of JSON while they are computed."""
        data, stop = await self._edit(request)
        size, lines = _parse_number(request, "size"), "lines" in request.query_params
        return _stream_response(self._compute_views(data, size, stop, lines=lines))

    async def next(self, request: Request) -> Response:
        """The next step of a document without curvature lines. Ends the work on earlier edits."""
        data, stop = await self._edit(request)
        return await _answered(lambda: self.desk.submit("fields", next_step, data, stop=stop).result())

    async def download(self, request: Request) -> Response:
        """A file of a document."""
        data, query = await _body(request), request.query_params
        wanted = query.get("what", ""), query.get("formulation", ""), query.get("format", "")
        return await _answered(
            lambda: _file_response(self.desk.submit("files", download, data, *wanted).result())
        )

    async def _edit(self, request: Request) -> tuple[bytes, IsOver]:
        data = await _body(request)
        return data, self.desk.begin(
            request.query_params.get("page", "")[:64], _parse_number(request, "edit")
        )

    def _compute_views(
        self, data: bytes, size: int, stop: IsOver, *, lines: bool
    ) -> Iterator[dict[str, Any]]:
        early, fine = None, Event()
        if size > _FINE:
            with suppress(NoStrokeError):  # on so coarse a grid
                view, drawn, field = self.desk.submit("fields", field_step, data, COARSE, stop=stop).result()
                yield view
                early = self.desk.submit(
                    "surfaces", surface_step, drawn, field, stop=lambda: stop() or fine.is_set()
                )
        finer = self.desk.submit("fields", field_step, data, stop=stop)
        if early is not None:
            wait({early, finer}, return_when=FIRST_COMPLETED)
            if early.done() and early.exception() is None:
                yield early.result()
        view, drawn, field = finer.result()
        fine.set()
        yield view
        surface = self.desk.submit("surfaces", surface_step, drawn, field, stop=stop)
        if lines:
            yield self.desk.submit("fields", lines_step, field, stop=stop).result()
        yield surface.result()
        yield {"stage": "done"}


def _parse_number(request: Request, name: str) -> int:
    """A whole number in the address, 0 for anything else."""
    text = request.query_params.get(name, "")
    return int(text) if text.isascii() and text.isdigit() and len(text) < 10 else 0


async def _body(request: Request) -> bytes:
    """The body of a request. Raises InputError when it is too long."""
    stated = request.headers.get("content-length", "0")
    parts, length = [], int(stated) if stated.isdigit() else 0
    if length <= MAX_BYTES:
        length = 0
        async for part in request.stream():
            parts.append(part)
            length += len(part)
            if length > MAX_BYTES:
                break
    if length > MAX_BYTES:
        raise InputError(f"the file has more than {MAX_BYTES // 10**6} MB; simplify the drawing")
    return b"".join(parts)


async def _answered(work: Callable[[], Any]) -> Response:
    """The result of work as a response, or its error as a message."""
    answer = await run_in_threadpool(work)
    return answer if isinstance(answer, Response) else JSONResponse(answer)


def _file_response(download: tuple[str, bytes]) -> Response:
    name, content = download
    headers = {"content-disposition": f'attachment; filename="{name}"'}
    return Response(content, media_type="application/octet-stream", headers=headers)


def _stream_response(steps: Iterator[dict[str, Any]]) -> Response:
    """A response with a line of JSON per step; an error is the last line."""

    def lines() -> Iterator[bytes]:
        try:
            for step in steps:
                yield json.dumps(step, allow_nan=False).encode() + b"\n"
        except ClosedError:
            return  # the page sees that the last line is missing
        except OvertakenError:
            yield b'{"stage": "overtaken"}\n'
        except CrossfieldError as error:
            yield _error_line(error)
        except Exception as error:  # noqa: BLE001 - the page shows it, and keeps its drawing
            yield _error_line(error)

    return StreamingResponse(lines(), media_type="application/x-ndjson")


def _error_line(error: Exception) -> bytes:
    return json.dumps({"stage": "error", "message": _describe(error)}).encode() + b"\n"


def _describe(error: Exception) -> str:
    """The message of an error, with a remedy on the page."""
    if isinstance(error, CrossfieldError):
        return str(error)
    if isinstance(error, MemoryError):
        return "there is not enough memory; choose a smaller size"
    reason = f"{type(error).__name__}: {shortened(error)}"
    return f"internal error, {reason}; save the drawing, and report it with the file"


async def _refused(_: Request, error: Exception) -> Response:
    return JSONResponse({"message": _describe(error)}, 422)


def build_application(desk: Desk, port: int, token: str, first: dict[str, Any] | None = None) -> ASGIApp:
    """The server behind its guard."""
    routes = [Mount(f"/{token}", routes=Page(desk, first).routes())]
    return Guard(
        Starlette(routes=routes, exception_handlers={CrossfieldError: _refused, Exception: _refused}),
        port,
        token,
    )


def listen(port: int) -> socket.socket:
    """A socket on this machine only; port 0 chooses a free one. Raises InputError for a port in use."""
    place = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    place.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        place.bind((LOOPBACK, port))
        place.listen()  # a browser may be faster than the server
    except OSError as error:
        place.close()
        reason = (error.strerror or str(error)).lower()
        raise InputError(f"port {port} cannot be used: {reason}; choose another with --port") from error
    return place


def serve(place: socket.socket, token: str, first: dict[str, Any] | None) -> None:
    """Serve the page until Ctrl-C."""
    with Desk() as desk:
        app = build_application(desk, place.getsockname()[1], token, first)
        config = uvicorn.Config(
            app,
            log_level="warning",
            access_log=False,
            server_header=False,
            lifespan="off",
            ws="none",
            timeout_graceful_shutdown=5,
        )
        with suppress(KeyboardInterrupt):
            _EndingServer(config, desk).run(sockets=[place])


class _EndingServer(uvicorn.Server):
    """A server that ends the work first, so that no answer keeps it running."""

    def __init__(self, config: uvicorn.Config, desk: Desk) -> None:
        super().__init__(config)
        self._desk = desk

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End all work, then all connections."""
        self._desk.close()
        await super().shutdown(sockets)
