/* What is written to a stream (stdout, stderr) between listen_to and heard_on, whose text lasts until the next call. One at a time. */
#ifndef TESTS_SUPPORT_HEARD_H
#define TESTS_SUPPORT_HEARD_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <unistd.h>

#include <cmocka.h>

static int old_stream, stream_number;
static FILE *kept_stream;

static inline void listen_to(FILE *stream)
{
    fflush(stream);
    stream_number = fileno(stream);
    kept_stream = tmpfile();
    old_stream = dup(stream_number);
    assert_true(kept_stream && old_stream >= 0 && dup2(fileno(kept_stream), stream_number) == stream_number);
}

static inline const char *heard_on(FILE *stream)
{
    static char text[8192];
    fflush(stream);
    dup2(old_stream, stream_number);
    close(old_stream);
    rewind(kept_stream);
    text[fread(text, 1, sizeof text - 1, kept_stream)] = '\0';
    fclose(kept_stream);
    return text;
}

#endif
