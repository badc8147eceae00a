#include "picture/channels.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* What a channel is in its layer. Beside X, Y is no luminance; beside chroma it is not all of the picture. */
enum role { RED, GREEN, BLUE, LUMINANCE, ALPHA, CHROMA, ABSCISSA, OTHER, ROLES };

struct layer {
    const char *name; /* borrowed; `length` characters */
    size_t length;
    int part, is_own; /* is_own: has no name in its part */
    int at[ROLES];    /* -1: none */
};

static enum role role_of(const struct pic_channel *c)
{
    static const struct {
        const char *name;
        enum role role;
    } known[] = {{"R", RED},       {"G", GREEN},
                 {"B", BLUE},      {"red", RED},
                 {"green", GREEN}, {"blue", BLUE},
                 {"Y", LUMINANCE}, {"L", LUMINANCE},
                 {"A", ALPHA},     {"alpha", ALPHA},
                 {"RY", CHROMA},   {"BY", CHROMA},
                 {"X", ABSCISSA},  {"luminance", LUMINANCE}};
    const char *dot = strrchr(c->name, '.'), *name = dot ? dot + 1 : c->name;
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++)
        if (strcasecmp(name, known[i].name) == 0)
            return known[i].role;
    return OTHER;
}

/* The layer of a channel, which is added if it is a new one. */
static struct layer *layer_of(struct layer *list, int *count, const struct pic_channel *c)
{
    const char *dot = strrchr(c->name, '.');
    struct layer found = {c->name, dot ? (size_t)(dot - c->name) : 0, c->part, 0, {0}};
    found.is_own = found.length == 0;
    if (found.is_own && c->part_name) {
        found.name = c->part_name;
        found.length = strlen(c->part_name);
    }
    for (int i = *count - 1; i >= 0; i--)
        if (list[i].part == found.part && list[i].length == found.length &&
            memcmp(list[i].name, found.name, found.length) == 0)
            return &list[i];
    for (int role = 0; role < ROLES; role++)
        found.at[role] = -1;
    list[*count] = found;
    return &list[(*count)++];
}

static int is_colour(const struct layer *l) { return l->at[RED] >= 0 && l->at[GREEN] >= 0 && l->at[BLUE] >= 0; }

/* The channel that is all of a grey layer; -1: it is no such layer. */
static int grey_of(const struct layer *l)
{
    int found = -1, n = 0;
    for (int role = RED; role <= LUMINANCE; role++)
        if (l->at[role] >= 0) {
            found = l->at[role];
            n++;
        }
    return n == 1 && l->at[CHROMA] < 0 && l->at[ABSCISSA] < 0 ? found : -1;
}

/* Whether the last words of its name are these. */
static int ends_in(const struct layer *l, const char *words)
{
    const size_t n = strlen(words);
    return l->length >= n && strncasecmp(l->name + l->length - n, words, n) == 0 &&
           (l->length == n || l->name[l->length - n - 1] == '.');
}

/* The one of its kind; NULL: there is none, or there are several, *colours of them in colour. */
static const struct layer *find_picture(const struct layer *list, int count, int *colours)
{
    /* Of Blender's compositor: the picture that it shows, beside the layers that the picture was made of. */
    static const char shown[] = "Composite.Combined";
    const struct layer *colour = NULL, *combined = NULL, *grey = NULL, *composite = NULL;
    int combineds = 0, greys = 0;
    *colours = 0;
    for (int i = 0; i < count; i++) {
        const struct layer *l = &list[i];
        if (l->part == 0 && l->is_own && (is_colour(l) || grey_of(l) >= 0))
            return l;
        if (is_colour(l) && l->length == sizeof shown - 1 && ends_in(l, shown))
            composite = l;
        if (is_colour(l) && ends_in(l, "Combined"))
            combined = ++combineds == 1 ? l : NULL;
        if (is_colour(l))
            colour = ++*colours == 1 ? l : NULL;
        else if (grey_of(l) >= 0)
            grey = ++greys == 1 ? l : NULL;
    }
    return composite ? composite : combined ? combined : *colours > 0 ? colour : grey;
}

static struct pic_choice choice_of(const struct layer *l)
{
    struct pic_choice choice = {.part = l->part};
    for (int role = RED; role <= BLUE && is_colour(l); role++)
        choice.at[choice.count++] = l->at[role];
    if (choice.count == 0)
        choice.at[choice.count++] = grey_of(l);
    if (l->at[ALPHA] >= 0)
        choice.at[choice.count++] = l->at[ALPHA];
    return choice;
}

/* Appends a name after a comma, or once "..." when there is no room for more. */
static void add_name(char *text, size_t room, const char *name, size_t length)
{
    const size_t used = strlen(text), least = sizeof ", ...";
    if (used >= 3 && strcmp(text + used - 3, "...") == 0)
        return;
    if (used + length + 2 + least < room)
        snprintf(text + used, room - used, "%s%.*s", used ? ", " : "", (int)length, name);
    else
        snprintf(text + used, room - used, "%s...", used ? ", " : "");
}

static int refuse_layers(const char *file, const struct layer *list, int count, struct base_err *err)
{
    char names[256] = "";
    for (int i = 0; i < count; i++)
        if (is_colour(&list[i]) && list[i].length > 0)
            add_name(names, sizeof names, list[i].name, list[i].length);
        else if (is_colour(&list[i]))
            add_name(names, sizeof names, "one without a name", 18);
    return base_fail(err, BASE_EINVAL, "%s: several layers, %s: keep one (expected R, G and B, or a layer Combined)", file,
                     names);
}

static int refuse_channels(const char *file, const struct pic_channel *list, int count, struct base_err *err)
{
    char names[256] = "";
    int chroma = 0;
    for (int i = 0; i < count; i++) {
        add_name(names, sizeof names, list[i].name, strlen(list[i].name));
        chroma |= role_of(&list[i]) == CHROMA;
    }
    if (chroma)
        return base_fail(err, BASE_EINVAL, "%s: luminance and chroma, %s: convert them to R, G and B", file, names);
    return base_fail(err, BASE_EINVAL, "%s: none of its channels is a picture: %s (expected R, G and B, or Y)", file, names);
}

/* The layers that the channels make. *out: to be freed. */
static int find_layers(const char *file, const struct pic_channel *list, int count, struct layer **out, int *layer_count,
                       struct base_err *err)
{
    *layer_count = 0;
    *out = calloc((size_t)count + 1, sizeof **out);
    if (!*out)
        return base_fail_nomem(err, file);
    for (int i = 0; i < count; i++) {
        struct layer *l = layer_of(*out, layer_count, &list[i]);
        const enum role role = role_of(&list[i]);
        if (l->at[role] < 0)
            l->at[role] = list[i].at;
    }
    return 0;
}

int pic_choose_channels(const char *file, const struct pic_channel *list, int count, struct pic_choice *out,
                        struct base_err *err)
{
    struct layer *layers;
    const struct pic_channel *only = NULL;
    int layer_count, colours, others = 0, rc = find_layers(file, list, count, &layers, &layer_count, err);
    if (rc)
        return rc;
    for (int i = 0; i < count; i++)
        if (role_of(&list[i]) != ALPHA || count == 1) {
            only = &list[i];
            others++;
        }
    const struct layer *picture = find_picture(layers, layer_count, &colours);
    if (picture)
        *out = choice_of(picture);
    else if (others == 1) {
        const struct layer *l = layer_of(layers, &layer_count, only);
        *out = (struct pic_choice){only->part, 1, {only->at}};
        if (l->at[ALPHA] >= 0 && l->at[ALPHA] != only->at)
            out->at[out->count++] = l->at[ALPHA];
    } else
        rc = colours > 1 ? refuse_layers(file, layers, layer_count, err) : refuse_channels(file, list, count, err);
    free(layers);
    return rc;
}

int pic_choose_layer(const char *file, const char *name, const struct pic_channel *list, int count, struct pic_choice *out,
                     struct base_err *err)
{
    struct layer *layers;
    const struct layer *found = NULL;
    int layer_count, rc = find_layers(file, list, count, &layers, &layer_count, err);
    if (rc)
        return rc;
    for (int i = 0; i < layer_count; i++) {
        const struct layer *l = &layers[i];
        const int is_grey = l->at[LUMINANCE] >= 0 && grey_of(l) >= 0;
        if ((is_colour(l) || is_grey) && (*name ? ends_in(l, name) : l->is_own) &&
            (!found || (found->length > strlen(name) && l->length == strlen(name))))
            found = l;
    }
    if (found && is_colour(found))
        *out = (struct pic_choice){found->part, 3, {found->at[RED], found->at[GREEN], found->at[BLUE]}};
    else if (found)
        *out = (struct pic_choice){found->part, 3, {found->at[LUMINANCE], found->at[LUMINANCE], found->at[LUMINANCE]}};
    else
        rc = base_fail(err, BASE_EINVAL, "%s: has no channels R, G and B in a layer '%s'", file, name);
    free(layers);
    return rc;
}
