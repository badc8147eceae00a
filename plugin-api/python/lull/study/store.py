# SPDX-License-Identifier: MIT
"""People and their trials: DIR/study.db (SQLite, write-ahead log). A change is on the disk before the call returns, except
while it is served (sync_behind).

A trial is (slot, revision): a slot of the person's plan, and how often it was done again (adjustment only). Trials are added
and never changed; the last revision counts. One thread; several processes may have the same file open."""
from __future__ import annotations

import contextlib
import os
import sqlite3
import threading
from typing import Any, Callable, Iterator, NamedTuple, Optional

from .files import Refused

MAX_PROFILE = 16384  # bytes
MAX_PEOPLE = 100000
MAX_TIMES = 607  # bytes of the times of a clip's frames: two intervals of 60 numbers of 4 digits
BUSY_S = 5.0

# FULL: an acknowledged trial survives a power cut, not only a crash
SETTINGS = "PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL; PRAGMA foreign_keys=ON; PRAGMA secure_delete=ON;"
SCHEMA = (
    "CREATE TABLE IF NOT EXISTS study (id TEXT PRIMARY KEY, version INTEGER NOT NULL);"
    "CREATE TABLE IF NOT EXISTS person (row INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE,"
    " key TEXT NOT NULL UNIQUE, seed INTEGER NOT NULL, created TEXT NOT NULL, profile TEXT NOT NULL);"
    "CREATE TABLE IF NOT EXISTS trial (person INTEGER NOT NULL REFERENCES person(row) ON DELETE CASCADE,"
    " slot INTEGER NOT NULL, revision INTEGER NOT NULL, level INTEGER NOT NULL, answer INTEGER NOT NULL,"
    " rating INTEGER NOT NULL, ms REAL NOT NULL, layout TEXT NOT NULL, at TEXT NOT NULL,"
    " frame_ms TEXT NOT NULL DEFAULT '', PRIMARY KEY (person, slot, revision)) WITHOUT ROWID;")


class Person(NamedTuple):
    row: int  # inside this file only
    id: str  # 8 hex digits: names the person in reports and exports
    key: str  # 32 hex digits: whoever has the key is the person
    seed: int
    created: str  # UTC, ISO 8601


class Trial(NamedTuple):
    slot: int
    revision: int
    level: int  # samples per pixel shown or set; 0 in catch trials and validations
    answer: int  # two intervals: the one said to be noisy, 1 or 2; validation: 1 same, 0 different
    rating: int  # validation: 1 very disturbing … 5 no difference
    ms: float  # from what was shown to the answer, by the page's clock
    layout: str = ""  # validation: "beside" or "flip"
    at: str = ""  # when it was stored: UTC, ISO 8601
    frame_ms: str = ""  # clips: how long each frame stood (plan.dropped_frames)


_COLUMNS = ", ".join(Trial._fields)


class Conflict(Exception):
    """Another trial is there in its place."""


class _Syncer:
    """Syncs a file, which must keep its inode, behind those who write to it, on a thread of its own: no answer waits for the
    disk. What is written while a sync runs goes to the disk with the next one, all of it together."""

    def __init__(self, path: str, on_failure: Callable[[str], None]) -> None:
        self._path, self._on_failure = path, on_failure
        self._file = os.open(path, os.O_RDWR | os.O_CLOEXEC)
        self._asked = threading.Condition()
        self._wanted = self._stop = False
        self._thread = threading.Thread(target=self._work)
        self._thread.start()

    def _work(self) -> None:
        while True:
            with self._asked:
                self._asked.wait_for(lambda: self._wanted or self._stop)
                if not self._wanted:
                    return
                self._wanted = False
            try:
                os.fdatasync(self._file)
            except OSError as error:  # nothing is synced after that
                self._on_failure(f"{self._path}: the latest answers may not be on the disk: {error.strerror}")
                return

    def want(self, stop: bool = False) -> None:
        with self._asked:
            self._wanted, self._stop = self._wanted or not stop, stop
            self._asked.notify()

    def stop(self) -> None:
        """Waits until all that was wanted is synced, or a sync failed."""
        self.want(stop=True)
        self._thread.join()
        os.close(self._file)


class Store:
    """`folder` None: in memory, for tests. create: made when missing, else nobody has taken part. `study_id` must be that of
    the study it was made for: the file belongs to one study for ever."""

    def __init__(self, folder: Optional[str], study_id: str, create: bool = False) -> None:
        self.path = os.path.join(folder, "study.db") if folder is not None else ":memory:"
        self._syncer: Optional[_Syncer] = None
        if folder is not None and not create and not os.path.exists(self.path):
            raise Refused(f"{self.path}: nobody has taken part yet: `lull-study serve {folder}` first")
        with self.failing():
            self._db = sqlite3.connect(self.path, timeout=BUSY_S, isolation_level=None)
            try:
                self._open(study_id)
            except BaseException:
                self._db.close()
                raise

    def _open(self, study_id: str) -> None:
        self._db.executescript(SETTINGS + SCHEMA)
        if not self._number("SELECT COUNT(*) FROM pragma_table_info('trial') WHERE name = 'frame_ms'"):
            # from before there were clips
            self._db.execute("ALTER TABLE trial ADD COLUMN frame_ms TEXT NOT NULL DEFAULT ''")
        self._db.execute("INSERT INTO study SELECT ?, 1 WHERE NOT EXISTS (SELECT 1 FROM study)", (study_id,))
        if self._db.execute("SELECT id FROM study").fetchone() != (study_id,):
            raise Refused(f"{self.path}: belongs to another study than study.json beside it")

    @contextlib.contextmanager
    def failing(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            raise Refused(f"{self.path}: {error}") from None

    def close(self) -> None:
        """Waits until everything is on the disk or the disk fails."""
        if self._syncer:
            self._syncer.stop()
        self._db.close()

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def sync_behind(self, on_failure: Callable[[str], None]) -> None:
        """Before it is served: from now on no call waits for the disk, except for one after another process has imported or
        deleted. A change is in the system's hands when the call returns, so that the end of the process, however it comes,
        loses nothing; it is synced right after, with all others that came meanwhile. A power cut loses what had not been
        synced, whole changes from the latest on. The log grows until the store is closed: about 5 KB a trial. on_failure:
        told, on another thread, why.

        NORMAL alone would still sync inside some requests: where the log is copied into the file, and where the first commit
        after that begins it anew. So the log is emptied here, then begun by setting what is set already, and grows from then
        on."""
        with self.failing():
            for statement in ("wal_checkpoint(TRUNCATE)", "user_version=0", "synchronous=NORMAL", "wal_autocheckpoint=0"):
                self._db.execute("PRAGMA " + statement).fetchall()
        self._syncer = _Syncer(self.path + "-wal", on_failure)

    @contextlib.contextmanager
    def changing(self) -> Iterator[None]:
        """All changes inside are on the disk together or not at all."""
        with self.failing():
            self._db.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._db.execute("COMMIT")
            except BaseException:
                if self._db.in_transaction:
                    self._db.execute("ROLLBACK")
                raise
        if self._syncer:
            self._syncer.want()

    def _number(self, query: str, *values: Any) -> int:
        found = self._db.execute(query, values).fetchone()
        return found[0] if found else 0

    # --- people ---

    def next_number(self) -> int:
        """How many people were ever added, deleted ones included: the next one's number."""
        return self._number("SELECT seq FROM sqlite_sequence WHERE name = 'person'")

    def add_person(self, person: Person, profile: str = "{}") -> int:
        """Inside changing(). The row; that of `person` does not matter."""
        return self._db.execute("INSERT INTO person (id, key, seed, created, profile) VALUES (?, ?, ?, ?, ?)",
                                (*person[1:], profile)).lastrowid or 0

    def people(self, where: str = "1", *values: str) -> list[Person]:
        """In order of arrival."""
        with self.failing():
            found = self._db.execute(f"SELECT row, id, key, seed, created FROM person WHERE {where} ORDER BY row", values)
            return [Person(*row) for row in found]

    def find(self, *, key: str = "", id: str = "") -> Optional[Person]:
        return next(iter(self.people("key = ?", key) if key else self.people("id = ?", id)), None)

    def profile(self, row: int) -> str:
        """What they told and measured, a JSON object."""
        with self.failing():
            found = self._db.execute("SELECT profile FROM person WHERE row = ?", (row,)).fetchone()
        return found[0] if found else "{}"

    def set_profile(self, row: int, profile: str) -> None:
        with self.changing():
            self._db.execute("UPDATE person SET profile = ? WHERE row = ?", (profile, row))

    def delete(self, row: int) -> None:
        """A person and all their trials; the freed pages are overwritten."""
        with self.changing():
            self._db.execute("DELETE FROM person WHERE row = ?", (row,))
        with self.failing():
            self._db.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()

    # --- trials ---

    def add_trial(self, row: int, trial: Trial) -> None:
        """Inside changing(). The same trial again is nothing; another one in its place is a Conflict."""
        old = self._db.execute(f"SELECT {_COLUMNS} FROM trial WHERE person = ? AND slot = ? AND revision = ?",
                               (row, trial.slot, trial.revision)).fetchone()
        if old is None:
            self._db.execute(f"INSERT INTO trial (person, {_COLUMNS}) VALUES (?{', ?' * len(trial)})", (row, *trial))
        elif Trial(*old)._replace(at="") != trial._replace(at=""):
            raise Conflict(f"trial {trial.slot} is done already, with another answer")

    def trials(self, row: int) -> list[Trial]:
        """By slot and revision."""
        with self.failing():
            found = self._db.execute(f"SELECT {_COLUMNS} FROM trial WHERE person = ? ORDER BY slot, revision", (row,))
            return [Trial(*trial) for trial in found]

    def slots_done(self, row: int) -> int:
        with self.failing():
            return self._number("SELECT COUNT(DISTINCT slot) FROM trial WHERE person = ?", row)

    def revisions(self, row: int, slot: int) -> int:
        with self.failing():
            return self._number("SELECT COUNT(*) FROM trial WHERE person = ? AND slot = ?", row, slot)
