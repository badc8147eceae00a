"""Figures as text and tables in Markdown."""
import datetime
import math


def table(heads, rows):
    return "\n".join(["| %s |" % " | ".join(heads), "|" + "---|" * len(heads)] + ["| %s |" % " | ".join(r) for r in rows]) + "\n"


def figure(value, form="%.2f"):
    return form % value if value is not None and math.isfinite(value) else "–"


def percent(value):
    return figure(100 * value, "%.0f %%") if value is not None else "–"


def provenance(measured):
    """When, where and at which commit something was measured."""
    day = datetime.date.fromisoformat(measured["date"]).strftime("%-d %B %Y")
    return "%s, %s, commit %s" % (day, measured["processor"], measured["commit"])
