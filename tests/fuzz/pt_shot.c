/* Shot tables and paths of the camera: any bytes either give one that keeps what its header promises, or one line. */
#include <stdint.h>
#include <stdlib.h>

#include "app/frame.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check_frames(const int *frames, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (frames[i] < 0 || frames[i] > PT_SHOT_LAST_FRAME || (i > 0 && frames[i] <= frames[i - 1]))
            abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct pt_shot_table table;
    struct pt_shot shot = {0};
    struct base_err err = {0}, why = {0};
    int rc = pt_shot_table_parse("f.csv", (const char *)data, size, &table, &err);
    if (rc ? err.text[0] == '\0' : table.frame_count == 0 || table.block_count == 0)
        abort();
    check_frames(table.frames, rc ? 0 : table.frame_count);
    for (size_t i = 0; !rc && i < table.frame_count * table.block_count; i++)
        if (table.spp[i] < 1 || table.spp[i] > INT32_MAX)
            abort();
    pt_shot_table_release(&table);
    rc = pt_shot_parse_path("f.csv", (const char *)data, size, &shot, &why);
    if (rc ? why.text[0] == '\0' : shot.count == 0)
        abort();
    check_frames(shot.frames, rc ? 0 : shot.count);
    pt_shot_release(&shot);
    return 0;
}
