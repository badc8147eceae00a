"""Runs functions named test_* and reports them as TAP lines; a test's docstring says what must hold."""
import contextlib
import os
import sys
import traceback


class Skip(Exception):
    """Raised by a test that cannot run here; the text says why."""


@contextlib.contextmanager
def denoiser(kind, build):
    """Open Image Denoise is tests/stub/oidn.c of this kind; "/…": another file; "real": that of build/oidn, else the test is skipped."""
    stub = os.path.abspath(os.path.join(build, "tests/oidn-stub/libOpenImageDenoise.so.2"))
    library = kind if kind[0] == "/" else os.path.abspath("build/oidn/lib") if kind == "real" else stub
    if not os.path.exists(library) and kind[0] != "/":
        raise Skip(f"no {library}")
    before = {name: os.environ.get(name) for name in ("LULL_OIDN", "OIDN_STUB")}
    os.environ.update(LULL_OIDN=library, OIDN_STUB=kind)
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})


def raises(kind, text, call, *arguments, **named):
    """The call raises this kind of exception with this text in its message, which is one line."""
    try:
        call(*arguments, **named)
    except kind as error:
        assert text in str(error) and "\n" not in str(error), f"message: {error}"
        return
    raise AssertionError(f"no {kind.__name__} was raised")


def main(namespace):
    tests = [f for name, f in namespace.items() if name.startswith("test_")]
    wanted = [a for a in sys.argv if a.startswith("test_")]
    for n, test in enumerate(tests, 1):
        if wanted and test.__name__ not in wanted:
            continue
        text = (test.__doc__ or test.__name__).strip().rstrip(".")
        try:
            test()
            print(f"ok {n} - {text}", flush=True)
        except Skip as reason:
            print(f"ok {n} - {text} # SKIP {reason}", flush=True)
        except BaseException:
            print(f"not ok {n} - {text}", flush=True)
            print("".join("#   " + line + "\n" for line in traceback.format_exc().splitlines()), end="", flush=True)
    print(f"1..{len(tests)}")
