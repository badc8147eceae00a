# SPDX-License-Identifier: MIT
"""`lull-study`: asks people, on a page that this machine serves, from how many samples on a block looks converged, or
whether a picture looks the same as its reference. A program, not a part of the bindings: of lull it imports how programs begin
and end (program), the version and the charts of plot; of it plot and judge import files and options.

Modules, top first: main, then prepare, server, report, transfer; then api, people, summary, figures, psychometric; then
store, plan, definition, options, files. What is on the disk: FORMAT.md. aiohttp, numpy, scipy and matplotlib are imported
only by the verbs that need them. """
