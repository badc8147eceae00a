# SPDX-License-Identifier: MIT
"""Serves a study over HTTP until told to stop. One thread answers all requests and never waits for the disk to sync
(Store.sync_behind); nothing outside is ever asked for anything."""
from __future__ import annotations

import asyncio
import contextlib
import functools
import ipaddress
import logging
import os
import re
import secrets
import signal
import socket
import sys
from typing import Any, NamedTuple

from aiohttp import web

from .api import MAX_BODY, Request, Response, Site, answer, now_utc, refusal
from .definition import read_study
from .files import Refused, read_file, write_line
from .store import Store

PORT = 8737
MAX_CONNECTIONS, IDLE_S, SWEEP_S = 1024, 120, 10

# unsafe-eval: the QUEST+ library's numeric part makes its loops with Function(); scripts still come from here alone
POLICY = ("default-src 'none'; script-src 'self' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
          "img-src 'self' blob: data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'")
HEADERS = {"X-Content-Type-Options": "nosniff", "X-Frame-Options": "DENY", "Cross-Origin-Resource-Policy": "same-origin",
           "Referrer-Policy": "no-referrer",  # the address holds the token and the person's key
           "Content-Security-Policy": POLICY, "Server": "lull-study"}


# --- where ---

class Address(NamedTuple):
    """Of --listen: ADDR, ADDR:PORT, [ADDR6] or [ADDR6]:PORT."""
    host: str
    port: int  # 0: any that is free
    ipv6: bool
    loopback: bool

    def shown(self, port: int) -> str:
        return f"[{self.host}]:{port}" if self.ipv6 else f"{self.host}:{port}"


def parse_address(text: str) -> Address:
    """Numbers only, no names: nothing is looked up."""
    prefix, ipv6 = f"--listen {text[:64]}: ", text.startswith("[")
    host, _, rest = text[1:].partition("]") if ipv6 else text.partition(":")
    port: str | None = rest if not ipv6 and ":" in text else rest[1:] if rest.startswith(":") else None
    if ipv6 and ("]" not in text or (rest and port is None)):
        raise Refused(prefix + "expected ADDRESS, ADDRESS:PORT or [ADDRESS6]:PORT")
    try:
        address = ipaddress.IPv6Address(host) if ipv6 else ipaddress.IPv4Address(host)
    except ValueError:
        raise Refused(prefix + "not an address in numbers, like 127.0.0.1 or [::1]") from None
    if port is not None and not (re.fullmatch("[0-9]{1,5}", port) and int(port) <= 65535):
        raise Refused(prefix + "a port is 0 … 65535")
    return Address(host, PORT if port is None else int(port), ipv6, address.is_loopback)


def _listen(address: Address) -> socket.socket:
    """A bound socket, so that the names by which it may be called are known before the first request."""
    made = socket.socket(socket.AF_INET6 if address.ipv6 else socket.AF_INET)
    try:
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.bind((address.host, address.port))
        made.listen(socket.SOMAXCONN)
    except OSError as error:
        made.close()
        raise Refused(f"cannot listen on {address.host}, port {address.port}: {error.strerror}") from None
    return made


def keep_token(folder: str) -> str:
    """DIR/token: made once, so that links stay good."""
    path = os.path.join(folder, "token")
    if not os.path.exists(path):
        write_line(path, secrets.token_hex(16))
    token = read_file(path, 256).decode("latin-1")
    if not re.fullmatch("[0-9a-f]{32}\n", token):
        raise Refused(f"{path}: not a token; delete the file for a new one")
    return token.strip()


# --- requests ---

def _clean(text: str, most: int) -> str:
    """What came from outside, without control characters."""
    return re.sub("[^ -~]", "?", text[:most])


def _log(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


class _Log(logging.Handler):
    """What the library has to say: a line each."""

    def emit(self, record: logging.LogRecord) -> None:
        why = record.exc_info[1] if record.exc_info else None
        _log(f"server: {_clean(f'{record.getMessage()}: {why}' if why else record.getMessage(), 300)}")


async def _read_body(request: web.BaseRequest) -> bytes | None:
    """None: it is too large."""
    body = b""
    while len(body) <= MAX_BODY:
        part = await request.content.readany()
        if not part:
            return body
        body += part
    return None


async def _handle(site: Site, request: web.BaseRequest) -> web.Response:
    path = request.raw_path.split("?", 1)[0]
    body = await _read_body(request)
    if body is None:
        r = refusal(413, "the body is too large")
    else:
        headers = (request.headers.get(name) for name in ("Host", "Origin", "Sec-Fetch-Site", "Content-Type"))
        r = answer(site, Request(request.method, path, body, *headers))
    if r.why:
        _log(f"{now_utc()} refused {r.status} {_clean(request.method, 8)} {_clean(path, 159)}: {_clean(r.why, 256)}")
    return _to_send(r)


def _to_send(r: Response) -> web.Response:
    cache = "private, max-age=31536000, immutable" if r.keep else "no-store"
    return web.Response(status=r.status, body=r.body, headers={**HEADERS, "Content-Type": r.type, "Cache-Control": cache})


class _Connection(web.RequestHandler):
    """Knows when something last came or went: aiohttp waits for ever for half a request."""
    is_too_many = False

    def connection_made(self, transport: Any) -> None:
        super().connection_made(transport)
        self.last_received, self.unsent = asyncio.get_running_loop().time(), 0
        if self.is_too_many:
            transport.abort()

    def data_received(self, data: bytes) -> None:
        self.last_received = asyncio.get_running_loop().time()
        super().data_received(data)

    def sweep(self, now: float) -> None:
        if not self.transport:
            return
        unsent, self.unsent = self.unsent, self.transport.get_write_buffer_size()
        if unsent != self.unsent:
            self.last_received = now
        elif now - self.last_received > IDLE_S:
            self.transport.abort()


class _Server(web.Server):
    def __call__(self) -> web.RequestHandler:
        made = _Connection(self, loop=self._loop, **self._kwargs)
        made.is_too_many = len(self.connections) >= MAX_CONNECTIONS
        return made


async def _sweep(server: web.Server) -> None:
    while True:
        await asyncio.sleep(SWEEP_S)
        for connection in list(server.connections):
            if isinstance(connection, _Connection):
                connection.sweep(asyncio.get_running_loop().time())


# --- running ---

async def _run(site: Site, listening: socket.socket, link: str, failures: list[str]) -> None:
    """failures: gets why the store cannot be synced any more."""
    loop, stop = asyncio.get_running_loop(), asyncio.Event()

    def fail(why: str) -> None:
        failures.append(why)
        with contextlib.suppress(RuntimeError):  # it has stopped already
            loop.call_soon_threadsafe(stop.set)

    logger = logging.Logger("lull-study")
    logger.addHandler(_Log())
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is not signal.SIG_IGN:  # nohup
            loop.add_signal_handler(number, stop.set)
    site.store.sync_behind(fail)
    server = _Server(functools.partial(_handle, site), access_log=None, logger=logger, keepalive_timeout=IDLE_S)
    sweeper = loop.create_task(_sweep(server))
    accepting = await loop.create_server(server, sock=listening)
    print(link, flush=True)
    await stop.wait()
    accepting.close()
    sweeper.cancel()
    await server.shutdown(1.0)


def serve(folder: str, page: str, listen: str) -> None:
    """Prints the link once it answers, and returns when interrupted, or when the store cannot be synced any more."""
    address = parse_address(listen)
    study = read_study(folder)
    token = None if address.loopback else keep_token(folder)
    failures: list[str] = []
    with Store(folder, study.id, create=True) as store, _listen(address) as listening:
        port = listening.getsockname()[1]
        hosts = [address.shown(port), f"localhost:{port}"] if address.loopback else None
        link = f"http://{address.shown(port)}/{token + '/' if token else ''}"
        asyncio.run(_run(Site(folder, page, study, store, token, hosts), listening, link, failures))
    if failures:
        raise Refused(failures[0])
