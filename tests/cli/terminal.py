"""Runs lull-render on a pseudo-terminal and plays what it writes: terminal.py COLUMNS LINES [interrupt=S] [narrow=S:COLUMNS] --
COMMAND... prints a JSON of what was on the screen at its fullest, what is left at the end, and the exit status."""
import fcntl
import json
import os
import pty
import re
import select
import signal
import struct
import sys
import termios

split = sys.argv.index("--")
columns, lines = int(sys.argv[1]), int(sys.argv[2])
options = dict(option.split("=") for option in sys.argv[3:split])
command = sys.argv[split + 1:]


class Screen:
    """Enough of a terminal: lines that break at the width, colours, and moves up and to the left."""

    def __init__(self):
        self.rows, self.y, self.x, self.colour, self.widest = [""], 0, 0, False, 0

    def write(self, text):
        for part in re.findall(r"\x1b\[[0-9;?]*[A-Za-z]|.|\n", text):
            if part == "\n":
                self.y += 1
                self.rows += [""] * (self.y + 1 - len(self.rows))
                self.x = 0  # the terminal's line discipline sends \r\n; either will do
            elif part == "\r":
                self.x = 0
            elif len(part) == 1 and part != "\x1b":
                row = self.rows[self.y].ljust(self.x)
                self.rows[self.y] = row[:self.x] + part + row[self.x + 1:]
                self.x += 1
                if not self.rows[self.y].startswith("lull-render"):  # what stays may be longer
                    self.widest = max(self.widest, self.x)
            elif part.endswith("A"):
                self.y = max(0, self.y - int(part[2:-1] or 1))
            elif part.endswith("J"):
                self.rows = self.rows[:self.y] + [self.rows[self.y][:self.x]]
            elif part.endswith("K"):
                self.rows[self.y] = self.rows[self.y][:self.x]
            elif part.endswith("m"):
                self.colour = part not in ("\x1b[0m", "\x1b[m")
            else:
                raise SystemExit(f"another escape: {part!r}")


def resize(fd, columns):
    fcntl.ioctl(fd, termios.TIOCSWINSZ, struct.pack("HHHH", lines, columns, 0, 0))


def unread(fd):
    """What has been written to the terminal by a child that is stopped."""
    text = b""
    while select.select([fd], [], [], 0)[0]:
        text += os.read(fd, 65536)
    return text


sized, has_size = os.pipe()
child, fd = pty.fork()
if child == 0:
    os.read(sized, 1)  # until the terminal has its size
    os.execvp(command[0], command)
resize(fd, columns)
os.write(has_size, b".")
before = termios.tcgetattr(fd)
screen, fullest, rest, widths = Screen(), [], b"", []
while True:
    try:
        rest += os.read(fd, 65536)
    except OSError:
        break
    whole = re.match(rb"(?:[^\x1b]|\x1b\[[0-9;?]*[A-Za-z])*", rest).end()  # not half an escape
    try:
        text, rest = rest[:whole].decode(), rest[whole:]
    except UnicodeDecodeError:
        continue
    screen.write(text)
    if sum(row.count("\u2580") for row in screen.rows) >= sum(row.count("\u2580") for row in fullest):
        fullest = list(screen.rows)
    if "narrow" in options and "\u2580" in "".join(screen.rows):
        os.kill(child, signal.SIGSTOP)  # what was written for the old width is none of the new one
        os.waitpid(child, os.WUNTRACED)
        screen.write((rest + unread(fd)).decode())
        resize(fd, int(options.pop("narrow")))
        widths, screen.widest, rest = [screen.widest], 0, b""
        os.kill(child, signal.SIGCONT)
    elif "interrupt" in options and "\u2580" in "".join(screen.rows):
        options.pop("interrupt")
        os.kill(child, signal.SIGINT)
status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
print(json.dumps({"status": status, "fullest": fullest, "left": screen.rows, "coloured": screen.colour, "widest": screen.widest,
                  "widest_before": widths}))
