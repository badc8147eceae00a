# SPDX-License-Identifier: MIT
"""python3 -m lull watch FOLDER|REPORT.json: the page of a render while it is made, on this machine only.

It reads what `lull-render --live --report FILE --preview FILE` writes and nothing else: the report, and beside it the picture
that its command line names. The page is that of --html; it asks each second what is new, and at the end it is what --html
writes. Standard library only.
"""
from __future__ import annotations

import argparse
import base64
import html
import json
import os
import sys
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, NoReturn, Optional

PAGE = Path(__file__).with_name("page.html")
MOST_BYTES = 1 << 28  # of a file that is read
HISTORY_BYTES = 1900000  # as the page of --html: of more, the checks of each block are left out
PICTURES, DATA = "<!-- pictures -->", "/* data */"
POLICY = "img-src data:;"  # of the page, which has all that it shows in it …
OWN_POLICY = "img-src data:; connect-src 'self';"  # … and of ours, which asks us what is new
NOTHING_YET = """<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><meta http-equiv="refresh" content="1"><title>Lull</title></head>
<body style="font: 15px/1.5 system-ui, sans-serif; margin: 3em; max-width: 45em; color-scheme: light dark"><p id="waiting">There is no report in
<code>%s</code> yet. A render writes one with <code>lull-render SCENE.pbrt --live --report report.json --preview picture.png</code>; this page
shows it as soon as it is there.</p></body></html>
"""


def read_report(path: Path) -> Optional[dict[str, Any]]:
    """The report in this file; None if there is none."""
    try:
        if not path.is_file() or path.stat().st_size > MOST_BYTES:
            return None
        report = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
    if not isinstance(report, dict) or not isinstance(report.get("blocks"), list):
        return None
    sizes = (report.get("width"), report.get("height"))
    return report if all(isinstance(n, (int, float)) and n > 0 for n in sizes) else None


def preview_name(report: dict[str, Any]) -> Optional[str]:
    """The last part of the name that the command line of the render gives its preview."""
    words = report.get("command")
    words = [w for w in words if isinstance(w, str)] if isinstance(words, list) else []
    for i in reversed(range(len(words))):
        option, _, value = words[i].partition("=")
        if len(option) > len("--pre") and "--preview".startswith(option):
            name = os.path.basename(value or (words[i + 1] if i + 1 < len(words) else ""))
            return name if name not in ("", ".", "..") and "\0" not in name else None
    return None


class Watched:
    """A folder, of whose reports the newest is shown, or one report. Nothing outside the folder is ever read."""

    def __init__(self, path: str):
        given = Path(path)
        self.only = None if given.is_dir() else given.name
        self.folder = (given if given.is_dir() else given.parent).resolve()

    def inside(self, name: str) -> Optional[Path]:
        """The regular file of this name, if it lies in the folder: a link that leaves it does not count."""
        path = self.folder / name
        try:
            real = path.resolve(strict=True)
            return path if real.parent == self.folder and real.is_file() else None
        except (OSError, RuntimeError, ValueError):
            return None

    def report(self) -> tuple[Optional[dict[str, Any]], float]:
        """What is shown, and when it was written."""
        try:
            names = [self.only] if self.only else [e.name for e in os.scandir(self.folder) if e.name.endswith(".json")]
        except OSError:
            names = []
        dated = []
        for path in filter(None, map(self.inside, names)):
            try:
                dated.append((path.stat().st_mtime, path))
            except OSError:
                continue
        for written, path in sorted(dated, reverse=True):
            report = read_report(path)
            if report is not None:
                return report, written
        return None, 0.0

    def picture(self, report: dict[str, Any]) -> Optional[bytes]:
        """The preview, if it is a PNG."""
        name = preview_name(report)
        path = self.inside(name) if name else None
        try:
            if path is None or not path.is_file() or path.stat().st_size > MOST_BYTES:
                return None
            data = path.read_bytes()
        except OSError:
            return None
        return data if data.startswith(b"\x89PNG\r\n\x1a\n") else None

    def state(self) -> Optional[dict[str, Any]]:
        """The data of the page; None while there is no report."""
        report, written = self.report()
        if report is None:
            return None
        picture = self.picture(report)
        if "history" in report and len(json.dumps(report, separators=(",", ":"))) > HISTORY_BYTES:
            del report["history"]
        return {"report": report, "quote": None, "live": {
            "age_s": round(max(0.0, time.time() - written), 1),
            "picture": f"data:image/png;base64,{base64.b64encode(picture).decode()}" if picture else None}}


def page_of(state: dict[str, Any], template: str) -> str:
    """As lull_host_page makes it (plugin-api/host/page.c), but that it goes on asking."""
    picture = state["live"]["picture"]
    shown = {**state, "live": {**state["live"], "picture": None}}
    before, rest = template.replace(POLICY, OWN_POLICY, 1).split(PICTURES, 1)
    between, after = rest.split(DATA, 1)
    image = f'<img alt="" data-layer="picture" src="{picture}">\n' if picture else ""
    return f"{before}{image}{between}{json.dumps(shown).replace('<', chr(92) + 'u003c')}{after}"


class Handler(BaseHTTPRequestHandler):
    """Answers / and /state, to this machine only."""
    server: "Server"
    protocol_version = "HTTP/1.1"
    timeout = 30

    def do_GET(self) -> None:  # noqa: N802 (http.server calls it so)
        """One of two answers; anything else is not found."""
        if self.headers.get("Host", "").rpartition(":")[0] not in ("127.0.0.1", "localhost"):  # a page from elsewhere asks
            self.answer(403, "text/plain", "this page is for this machine\n")
        elif self.path == "/":
            state = self.server.watched.state()
            self.answer(200, "text/html", page_of(state, self.server.template) if state else
                        NOTHING_YET % html.escape(str(self.server.watched.folder)))
        elif self.path == "/state":
            self.answer(200, "application/json", json.dumps(self.server.watched.state()))
        else:
            self.answer(404, "text/plain", "no such page\n")

    def answer(self, status: int, kind: str, text: str) -> None:
        """All of it at once."""
        body = text.encode("utf-8", "replace")
        self.send_response(status)
        for name, value in (("Content-Type", f"{kind}; charset=utf-8"), ("Content-Length", str(len(body))),
                            ("Cache-Control", "no-store"), ("X-Content-Type-Options", "nosniff"),
                            ("X-Frame-Options", "DENY")):
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: Any) -> None:
        """Nobody wants to read that."""


class Server(ThreadingHTTPServer):
    """Of one folder or report, on 127.0.0.1. port 0: any that is free."""
    daemon_threads = True

    def __init__(self, path: str, port: int = 0):
        self.watched, self.template = Watched(path), PAGE.read_text(encoding="utf-8")
        super().__init__(("127.0.0.1", port), Handler)

    @property
    def address(self) -> str:
        """For a browser."""
        return f"http://127.0.0.1:{self.server_address[1]}/"

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that leaves in the middle is none."""
        if not isinstance(sys.exc_info()[1], OSError):
            super().handle_error(request, client_address)


class Arguments(argparse.ArgumentParser):
    """Whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        """Exit status 2."""
        self.exit(2, f"lull watch: {message}\n")


def main(words: list[str]) -> int:
    """Serves until Ctrl-C; the exit status."""
    parser = Arguments(prog="python3 -m lull watch", description="Shows a render in a browser while it is made, from what lull-render "
                       "--live --report FILE --preview FILE writes. Only this machine can ask; Ctrl-C ends it.")
    parser.add_argument("path", metavar="FOLDER|REPORT.json", help="the folder, whose newest report is shown, or one report")
    parser.add_argument("--port", type=int, default=0, help="on 127.0.0.1 (any that is free)")
    options = parser.parse_args(words)
    if not 0 <= options.port <= 65535:
        parser.error(f"--port {options.port}: expected 0 to 65535")
    if not os.path.isdir(os.path.dirname(os.path.abspath(options.path))) or \
            (not os.path.isdir(options.path) and not options.path.endswith(".json")):
        parser.error(f"{options.path}: no such folder, and no name of a report (FILE.json)")
    try:
        server = Server(options.path, options.port)
    except OSError as error:
        print(f"lull watch: port {options.port}: {error.strerror}", file=sys.stderr)
        return 2
    print(server.address, flush=True)
    try:
        server.serve_forever(poll_interval=0.2)
    except KeyboardInterrupt:
        pass
    server.server_close()
    return 0
