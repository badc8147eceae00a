# SPDX-License-Identifier: MIT
"""lull-plot, or python3 -m lull plot: pictures of the numbers that ggn writes.

main.py is the command, kinds.py what is drawn of which file, charts.py how a chart looks, canvas.py what of matplotlib it takes. It shares options and files with
lull.study, which draws its report with charts.py, and imports nothing else of lull; matplotlib is imported when something is drawn."""
