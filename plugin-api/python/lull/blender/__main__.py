# SPDX-License-Identifier: MIT
import sys

from .cli import launch

sys.exit(launch())
