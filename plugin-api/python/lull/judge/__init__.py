# SPDX-License-Identifier: MIT
"""What `ggn evaluate`, `ggn cost`, `ggn compare` and the fits of `ggn label` judge: ggn reads and replays, this reckons.

Nothing here needs numpy. Numbers that are not known are NaN, in JSON null.
"""
