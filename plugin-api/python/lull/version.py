# SPDX-License-Identifier: MIT
"""The version of the whole project, from the header that the programs in C take it from: it lies beside. Imports nothing of lull."""
import re
from pathlib import Path

PRODUCT = re.findall(r'^#define BASE_VERSION "(.+)"$', Path(__file__).with_name("version.h").read_text(encoding="utf-8"), re.M)[0]
SOFTWARE = f"lull for Python {PRODUCT}"  # in files, and to criteria
