#include "model/checkpoint.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const net_name[GGN_NETS] = {"denoiser", "generator", "discriminator"};
static const char *const array_name[] = {"params", "mean", "var", "m", "v"};

static int same_networks(const struct ggn_hyper *a, const struct ggn_hyper *b, struct base_err *err)
{
    if (a->preset == b->preset && a->height == b->height && a->width == b->width && a->window == b->window &&
        a->k_r == b->k_r && a->k_m == b->k_m && a->k_d == b->k_d)
        return 0;
    return base_fail(err, BASE_EINVAL, "the networks differ in size or preset");
}

static void array_title(char name[GGN_CONTAINER_NAME], int net, int i)
{
    snprintf(name, GGN_CONTAINER_NAME, "%s/%s", net_name[net], array_name[i]);
}

static int add_arrays(struct ggn_trainer_f32 *t, struct ggn_container *c, struct base_err *err)
{
    char name[GGN_CONTAINER_NAME];
    size_t count;
    float *array;

    for (int net = 0; net < GGN_NETS; net++)
        for (int i = 0; (array = ggn_trainer_state_f32(t, net, i, &count)); i++) {
            int dim = (int)count;
            array_title(name, net, i);
            int rc = ggn_container_add(c, name, GGN_F32, 1, &dim, array, err);
            if (rc)
                return rc;
        }
    return 0;
}

static int add_item(cJSON *to, const char *name, cJSON *item)
{
    return item && (name ? cJSON_AddItemToObject(to, name, item) : cJSON_AddItemToArray(to, item));
}

static char *describe(const struct ggn_trainer_f32 *t, const cJSON *loop)
{
    const int hyper[] = {(int)t->hyper.preset, t->hyper.height, t->hyper.width, t->hyper.window,
                         t->hyper.k_r,         t->hyper.k_m,    t->hyper.k_d};
    cJSON *root = cJSON_CreateObject();
    int ok = root && cJSON_AddStringToObject(root, "kind", "checkpoint") &&
             add_item(root, "hyper", cJSON_CreateIntArray(hyper, sizeof hyper / sizeof hyper[0])) &&
             cJSON_AddNumberToObject(root, "steps", (double)t->steps);
    cJSON *updates = ok ? cJSON_AddArrayToObject(root, "updates") : NULL;

    ok = updates != NULL;
    for (int net = 0; net < GGN_NETS; net++)
        ok = ok && add_item(updates, NULL, cJSON_CreateNumber((double)t->adam_t[net]));
    ok = ok && add_item(root, "loop", loop ? cJSON_Duplicate(loop, 1) : cJSON_CreateObject());
    char *text = ok ? cJSON_Print(root) : NULL;
    cJSON_Delete(root);
    return text;
}

int ggn_checkpoint_save(struct ggn_trainer_f32 *t, const cJSON *loop, const char *path, struct base_err *err)
{
    struct ggn_container c = {0};
    int rc = add_arrays(t, &c, err);

    if (!rc && !(c.json = describe(t, loop)))
        rc = base_fail_nomem(err, "checkpoint");
    if (!rc)
        rc = ggn_container_write(&c, path, err);
    ggn_container_release(&c);
    return rc;
}

static int number_at(const cJSON *item, double *out, struct base_err *err)
{
    if (!cJSON_IsNumber(item) || !(item->valuedouble >= 0 && item->valuedouble < 9e15))
        return base_fail(err, BASE_EINVAL, "not a checkpoint of this program (counters)");
    *out = item->valuedouble;
    return 0;
}

/* Counters and the check that the file belongs to these networks. */
static int read_description(const struct ggn_trainer_f32 *t, const cJSON *root, double counter[1 + GGN_NETS],
                            struct base_err *err)
{
    const cJSON *kind = cJSON_GetObjectItemCaseSensitive(root, "kind"),
                *hyper = cJSON_GetObjectItemCaseSensitive(root, "hyper");
    struct ggn_hyper read = {0};
    int *const field[] = {&read.height, &read.width, &read.window, &read.k_r, &read.k_m, &read.k_d};

    if (!cJSON_IsString(kind) || strcmp(kind->valuestring, "checkpoint") != 0)
        return base_fail(err, BASE_EINVAL, "not a training checkpoint");
    for (int i = -1; i < 6; i++) {
        double value = 0;
        int rc = number_at(cJSON_GetArrayItem(hyper, i + 1), &value, err);
        if (rc)
            return rc;
        if (i < 0)
            read.preset = (enum ggn_preset)(value < 1e6 ? (int)value : 0);
        else
            *field[i] = value < 1e6 ? (int)value : 0;
    }
    int rc = same_networks(&read, &t->hyper, err);
    if (!rc)
        rc = number_at(cJSON_GetObjectItemCaseSensitive(root, "steps"), &counter[0], err);
    for (int net = 0; net < GGN_NETS && !rc; net++)
        rc = number_at(cJSON_GetArrayItem(cJSON_GetObjectItemCaseSensitive(root, "updates"), net), &counter[1 + net], err);
    return rc;
}

/* Decodes into the trainer; `trial` only checks, into scratch memory. */
static int read_arrays(struct ggn_trainer_f32 *t, const struct ggn_container *c, int trial, struct base_err *err)
{
    char name[GGN_CONTAINER_NAME];
    size_t count;
    float *array;
    int rc = 0, entries = 0;

    for (int net = 0; net < GGN_NETS && !rc; net++)
        for (int i = 0; !rc && (array = ggn_trainer_state_f32(t, net, i, &count)); i++, entries++) {
            int dim = (int)count;
            float *scratch = trial ? malloc((count + 1) * sizeof *scratch) : NULL;
            array_title(name, net, i);
            rc = trial && !scratch ? base_fail_nomem(err, "checkpoint")
                                   : ggn_container_get(c, name, 1, &dim, trial ? scratch : array, err);
            free(scratch);
        }
    if (!rc && entries != c->n_entries)
        rc = base_fail(err, BASE_EINVAL, "made by a run that trained other parts");
    return rc;
}

static int load(struct ggn_trainer_f32 *t, cJSON **loop, const struct ggn_container *c, struct base_err *err)
{
    double counter[1 + GGN_NETS];
    cJSON *root = cJSON_Parse(c->json);
    int rc = root ? read_description(t, root, counter, err) : base_fail(err, BASE_EINVAL, "the description is not JSON");

    if (!rc)
        rc = read_arrays(t, c, 1, err);
    if (!rc)
        rc = read_arrays(t, c, 0, err);
    if (!rc) {
        t->steps = (uint64_t)counter[0];
        for (int net = 0; net < GGN_NETS; net++) {
            t->adam_t[net] = (uint64_t)counter[1 + net];
            ggn_weights_pack_f32(t->weights[net]);
        }
        ggn_trainer_keep_f32(t);
        if (loop)
            *loop = cJSON_DetachItemFromObjectCaseSensitive(root, "loop");
    }
    cJSON_Delete(root);
    return rc;
}

int ggn_checkpoint_load(struct ggn_trainer_f32 *t, cJSON **loop, const char *path, struct base_err *err)
{
    struct ggn_container c;
    struct base_err inner = {0};
    int rc = ggn_container_read(&c, path, err);

    if (rc)
        return rc;
    rc = load(t, loop, &c, &inner);
    ggn_container_release(&c);
    return rc ? base_fail(err, rc, "%s: %s", path, inner.text) : 0;
}

static void copy_weights(struct ggn_weights_f32 *to, const struct ggn_weights_f32 *from)
{
    memcpy(to->params, from->params, to->graph->n_params * sizeof *to->params);
    memcpy(to->mean, from->mean, to->graph->n_stats * sizeof *to->mean);
    memcpy(to->var, from->var, to->graph->n_stats * sizeof *to->var);
    ggn_weights_pack_f32(to);
}

static int in_parts(int net, int parts)
{
    return (parts & (net == GGN_NET_R ? GGN_TRAIN_R : GGN_TRAIN_MD)) != 0;
}

int ggn_model_from_trainer(struct ggn_model *model, const struct ggn_trainer_f32 *t, int parts, struct base_err *err)
{
    int rc = same_networks(&model->hyper, &t->hyper, err);

    for (int net = 0; net < GGN_NETS && !rc; net++)
        if (in_parts(net, parts))
            copy_weights(model->weights[net], t->weights[net]);
    return rc;
}

int ggn_trainer_from_model(struct ggn_trainer_f32 *t, const struct ggn_model *model, int parts, struct base_err *err)
{
    int rc = same_networks(&model->hyper, &t->hyper, err);

    for (int net = 0; net < GGN_NETS && !rc; net++)
        if (in_parts(net, parts))
            copy_weights(t->weights[net], model->weights[net]);
    if (!rc)
        ggn_trainer_keep_f32(t);
    return rc;
}
