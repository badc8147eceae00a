"""Records the packets that tests/unit/api_host_display.c expects, as the viewer's own client makes them:
    python3 -m venv build/tev && build/tev/bin/pip install tevclient==1.0.4 && build/tev/bin/python tests/unit/api_host_display/record.py"""
import pathlib

import numpy as np
import tevclient as tev
from tevclient import packet

HERE = pathlib.Path(__file__).parent
CHANNELS = ["R", "G", "B", "lull.spp", "lull.p_noisy", "lull.error"]
NAME = "a scene.pbrt"

tile = np.zeros((2, 3, 6), dtype=np.float32)
for y in range(2):
    for x in range(3):
        tile[y, x] = [x + 0.25, y - 0.5, 1e-3 * (x + y), 48, 0.125, 3.5]

# One active block of 64 x 48 pixels, one of 32 x 32 beside it that stopped at 1,903 samples.
side = 2.0
figures = {"1": [[(1, 0), (1, 2)]], "9": [[(1, 1), (0, 1), (0, 0), (1, 0), (1, 2), (0, 2)]],
           "0": [[(0, 0), (1, 0), (1, 2), (0, 2), (0, 0)]], "3": [[(0, 0), (1, 0), (1, 2), (0, 2)], [(0, 1), (1, 1)]]}
drawing = [tev.vg_begin_path(), tev.vg_rect(64.5, 0.5, 31, 31)]
for n, figure in enumerate("1903"):
    left, top = 64 + side + 1.5 * side * n, side
    for line in figures[figure]:
        for i, (x, y) in enumerate(line):
            drawing.append((tev.vg_line_to if i else tev.vg_move_to)(left + side * x, top + side * y))
drawing += [tev.vg_stroke_color(1, 1, 1, 0.35), tev.vg_stroke(), tev.vg_begin_path(), tev.vg_rect(0.5, 0.5, 63, 47),
            tev.vg_rect(1.5, 1.5, 61, 45), tev.vg_stroke_color(1, 0.72, 0, 1), tev.vg_stroke()]

(HERE / "create.bin").write_bytes(packet.create_image(NAME, 96, 48, CHANNELS, True))
(HERE / "update.bin").write_bytes(packet.update_image(NAME, tile, CHANNELS, 64, 5))
(HERE / "marks.bin").write_bytes(packet.update_vector_graphics(NAME, drawing))
