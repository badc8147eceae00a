/*
 * manifest.json of a recorded frame (version 2 of FORMAT.md): which view it is, what a criterion is told of the frame, which
 * blocks it has, and in which files looks, references and added planes are.
 */
#ifndef SEQUENCE_RECORDING_H
#define SEQUENCE_RECORDING_H

#include "sequence/look.h"
#include "sequence/manifest.h"

enum { SEQ_REFERENCES = 2, SEQ_TEXT = 4096 };

/* What is recorded one after the other. A file that belongs to none of it has planes that were added. */
enum seq_part { SEQ_PART_LOOKS, SEQ_PART_BEYOND, SEQ_PART_REFERENCE, SEQ_PART_ADDED };

struct seq_recording_file {
    char name[64]; /* a plain one inside the folder */
    enum seq_part part;
    char layer[64]; /* of added planes: what they are */
    uint64_t bytes;
    uint32_t crc32;
};

/* What a criterion is told of the frame (struct lull_frame), and what else the looks depend on. */
struct seq_recording_frame {
    uint32_t flags;
    char transfer[16]; /* srgb, linear, gamma */
    double gamma, exposure, sample_clamp, rgb_to_xyz[9], max_seam;
    uint64_t spp_min, spp_max;
};

struct seq_recording {
    /* Levels: those that all blocks have; none: each block has the looks of the criterion. Of its blocks only the rectangles
     * are used; the index is the id. */
    struct seq_manifest of;
    struct seq_recording_frame frame;
    char spec[SEQ_TEXT], criterion[256], version[256]; /* "": nobody was asked. spec: as it was named */
    char parameters[SEQ_TEXT];                         /* all of it that have a value, as lines "key=value\n" */
    uint32_t planes;                                   /* mask, bits 1 << number */
    uint32_t finished;                                 /* parts that are whole, bits 1 << part */
    uint32_t n_files, room;
    struct seq_recording_file *files; /* owns */
};

/* Reads DIR/manifest.json and checks it. */
int seq_recording_read(const char *dir, struct seq_recording *m, struct base_err *err);
int seq_recording_parse(const char *path, const char *text, size_t size, struct seq_recording *m, struct base_err *err);
/* Writes it atomically. */
int seq_recording_write(const char *dir, const struct seq_recording *m, struct base_err *err);
void seq_recording_release(struct seq_recording *m);

/* What tells two recordings apart, up to their files. */
void seq_recording_identity(const struct seq_recording *m, struct base_identity *to);

/* Appends a file. */
int seq_recording_add(struct seq_recording *m, const struct seq_recording_file *file, struct base_err *err);
/* Reads a file of it and holds it against the manifest: size, CRC, picture, rectangles of blocks. */
int seq_recording_read_look(const char *dir, const struct seq_recording *m, uint32_t index, struct seq_look *look,
                            struct base_err *err);

#endif
