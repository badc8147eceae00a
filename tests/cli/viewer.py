"""A viewer of sixty lines: viewer.py PORT_FILE OUT.json [close | silent] receives what lull-render --display-server sends
until the connection ends, paints it, and writes what it has: images, channels, drawings. `close`: leaves once after two tiles
and comes back; `silent`: takes nothing for ever."""
import json
import math
import socket
import struct
import sys
import time

ARGUMENTS = {0: 0, 1: 0, 2: 4, 4: 4, 3: 0, 5: 0, 6: 0, 7: 0, 10: 2, 11: 2, 18: 4}  # floats of each drawing command


class Packet:
    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, form):
        values = struct.unpack_from("<" + form, self.data, self.at)
        self.at += struct.calcsize("<" + form)
        return values if len(values) > 1 else values[0]

    def text(self):
        end = self.data.index(0, self.at)
        text, self.at = self.data[self.at:end].decode(), end + 1
        return text

    def texts(self):
        return [self.text() for _ in range(self.take("i"))]


def whole(connection, size):
    data = b""
    while len(data) < size and (part := connection.recv(size - len(data))):
        data += part
    return data


def receive(connection, seen, limit):
    while len(head := whole(connection, 4)) == 4 and seen["updates"] < limit:
        size = struct.unpack("<I", head)[0]
        p = Packet(whole(connection, size - 4))
        if len(p.data) < size - 4:
            return
        kind, _grab, name = p.take("B"), p.take("?"), p.text()
        if kind == 4:
            (width, height), channels = p.take("ii"), p.texts()
            seen.update(name=name, width=width, height=height, channels=channels, creates=seen["creates"] + 1)
            seen["pixels"] = [[None] * (width * height) for _ in channels]
        elif kind == 6:
            channels, (x, y, w, h) = p.texts(), p.take("iiii")
            offsets, strides = p.take(f"{len(channels)}q"), p.take(f"{len(channels)}q")
            data = p.take(f"{(len(p.data) - p.at) // 4}f")
            seen["updates"] += 1
            for c, (to, stride) in enumerate(zip(offsets, strides)):
                for row in range(h):
                    values = data[to + row * w * stride:to + ((row + 1) * w - 1) * stride + 1:stride]
                    begin = (y + row) * seen["width"] + x
                    seen["pixels"][c][begin:begin + w] = [v if math.isfinite(v) else None for v in values]
        elif kind == 8:
            append, count = p.take("?"), p.take("I")
            commands = [[t, list(p.take(f"{ARGUMENTS[t]}f")) if ARGUMENTS[t] else []] for t in (p.take("B") for _ in range(count))]
            seen.update(drawing=commands, append=append, drawings=seen["drawings"] + 1)
        assert p.at == len(p.data), (kind, p.at, len(p.data))


port_file, out, *mode = sys.argv[1:]
with socket.create_server(("127.0.0.1", 0)) as server:
    with open(port_file + ".new", "w") as f:
        f.write(str(server.getsockname()[1]))
    __import__("os").rename(port_file + ".new", port_file)
    seen = {"creates": 0, "updates": 0, "drawings": 0}
    for limit in ([2, 1 << 60] if mode == ["close"] else [1 << 60]):
        connection = server.accept()[0]
        if mode == ["silent"]:
            time.sleep(600)
        receive(connection, seen, limit)
        connection.close()
with open(out, "w") as f:
    json.dump(seen, f)
