#include "support/base_made_block.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/colour.h"

double made_mean[3 * MADE_P], made_half[3 * MADE_P];

uint8_t made_display[3 * MADE_P];

void made_fill(int seed)
{
    for (int i = 0; i < 3 * MADE_P; i++) {
        made_mean[i] = fabs(0.6 + 0.7 * sin(0.1 * i + seed));
        made_half[i] = 0.05 * cos(1.7 * i + seed);
        made_display[i] = base_srgb_code(made_mean[i]);
    }
}

void made_build(struct seq_builder *w)
{
    struct seq_stat stats[2] = {{"dammertz", 0.25}, {"seconds", 3.5}};
    assert_int_equal(seq_builder_init(w, MADE_W, MADE_H, 400, 200, 9, 77, NULL), 0);
    for (uint32_t i = 0; i < 4; i++) {
        made_fill((int)i);
        struct seq_frame f = {.spp = i < 3 ? 20u << i : 4096u,
                              .half_spp = 10,
                              .is_reference = i == 3,
                              .full = i == 1,
                              .display = i == 2 ? NULL : made_display,
                              .mean = made_mean,
                              .half = made_half,
                              .stats = stats,
                              .n_stats = 2};
        assert_int_equal(seq_builder_add(w, &f, NULL), 0);
    }
}

char made_dir[] = "/tmp/base_sequence.XXXXXX";

char made_path[64];

int made_begin(void **state)
{
    (void)state;
    if (!mkdtemp(made_dir))
        return -1;
    snprintf(made_path, sizeof made_path, "%s/block-00009.lseq", made_dir);
    return 0;
}

int made_end(void **state)
{
    (void)state;
    char path[64];
    snprintf(path, sizeof path, "%s/manifest.json", made_dir);
    unlink(path);
    unlink(made_path);
    return rmdir(made_dir);
}
