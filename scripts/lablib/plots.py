"""Pictures, by the charts of lull-plot."""
import os

from lablib.tool import Refused


def charts():
    """The module lull.plot.charts; it needs matplotlib, which pages do without."""
    try:
        from lull.plot import charts as module
    except ImportError as why:
        raise Refused("%s is needed: apt-get install python3-matplotlib python3-numpy" % (why.name or "numpy")) from why
    return module


def draw(folder, name, size, some, across=2):
    """The picture of `some` charts, side by side in rows of `across`."""
    module = charts()
    try:
        module.draw(os.path.join(folder, name), some, size, across)
    except module.Refused as why:
        raise Refused(str(why)) from why
