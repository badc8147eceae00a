"""Runs functions named test_* and reports them as TAP lines; a test's docstring says what must hold."""
import contextlib
import importlib
import inspect
import os
import pkgutil
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


def undescribed(package):
    """Public names in a package's own modules that lack a docstring or a type (parameter, result), and what is missing."""
    names = [m.name for m in pkgutil.iter_modules(package.__path__, f"{package.__name__}.") if not m.ispkg]
    for module in (package, *(importlib.import_module(n) for n in names if not n.endswith("__main__"))):
        public = {n: v for n, v in vars(module).items() if n[0] != "_" and getattr(v, "__module__", None) == module.__name__}
        for owner in (module, *filter(inspect.isclass, public.values())):
            if not owner.__doc__:
                yield f"{module.__name__} {owner.__name__}: docstring"
            for name, value in (public if owner is module else vars(owner)).items():
                value = inspect.unwrap(getattr(value, "fget", None) or getattr(value, "__func__", value))
                if inspect.isfunction(value) and (name[0] != "_" or name == "__init__"):
                    wanted = {*inspect.signature(value).parameters, *(() if name == "__init__" else ("return",))}
                    missing = wanted - {*value.__annotations__, "self", "cls"}
                    missing |= set() if value.__doc__ or name == "__init__" else {"docstring"}
                    if missing:
                        yield f"{module.__name__} {value.__qualname__}: {', '.join(sorted(missing))}"


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
