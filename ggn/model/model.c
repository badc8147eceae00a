#include "model/model.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/json.h"

/* most: of the parameters, which must fit into a file before memory is asked for them. */
static struct ggn_model *create(const struct ggn_hyper *hyper, size_t most, struct base_err *err)
{
    struct ggn_model *m = calloc(1, sizeof *m);
    size_t params = 0;
    if (!m) {
        base_fail_nomem(err, "model");
        return NULL;
    }
    m->hyper = *hyper;
    m->policy = ggn_policy_default();
    m->policy.ratio = 1.2;
    m->policy.passes = 2;
    m->provenance = cJSON_CreateObject();
    int rc = m->provenance ? 0 : base_fail_nomem(err, "model");
    for (int net = 0; net < GGN_NETS && !rc; net++) {
        rc = ggn_network_build(&m->graph[net], net, hyper, err);
        params += m->graph[net].n_params;
    }
    if (!rc && params > most)
        rc = base_fail(err, BASE_EINVAL, "the file is too small for networks of this size");
    for (int net = 0; net < GGN_NETS && !rc; net++)
        if (!(m->weights[net] = ggn_weights_create(&m->graph[net], NULL, 0, err)))
            rc = BASE_ENOMEM;
    if (!rc)
        return m;
    ggn_model_destroy(m);
    return NULL;
}

struct ggn_model *ggn_model_create(const struct ggn_hyper *hyper, struct base_err *err)
{
    return create(hyper, SIZE_MAX, err);
}

void ggn_model_destroy(struct ggn_model *m)
{
    if (!m)
        return;
    for (int net = 0; net < GGN_NETS; net++)
        ggn_weights_destroy(m->weights[net]);
    cJSON_Delete(m->provenance);
    free(m);
}

/* What is done with each tensor: read from a file, or added to one. */
struct visit {
    const struct ggn_container *from;
    struct ggn_container *to;
    enum ggn_type type;
};

static int visit(const struct visit *v, const char *name, int is_weight, int rank, const int *dim, float *values,
                 struct base_err *err)
{
    if (v->from)
        return ggn_container_get(v->from, name, rank, dim, values, err);
    return ggn_container_add(v->to, name, is_weight ? v->type : GGN_F32, rank, dim, values, err);
}

static int visit_all(const struct visit *v, const struct ggn_model *m, int *count, struct base_err *err)
{
    char name[GGN_CONTAINER_NAME];
    for (int net = 0; net < GGN_NETS; net++) {
        const struct ggn_graph *g = &m->graph[net];
        for (int i = 0; i < g->n_tensors; i++) {
            const struct ggn_tensor *t = &g->tensor[i];
            const size_t stats = g->layer[t->layer].stats;
            snprintf(name, sizeof name, "%s/%s", g->name, t->name);
            int rc = visit(v, name, t->ndim > 1, t->ndim, t->dim, m->weights[net]->params + t->offset, err);
            ++*count;
            if (!rc && t->is_bn) { /* weight and bias of a batch norm bring the mean and the variance with them */
                size_t stem = strlen(name) - strlen(t->is_bias ? "bias" : "weight");
                snprintf(name + stem, sizeof name - stem, "%s", t->is_bias ? "var" : "mean");
                rc = visit(v, name, 0, 1, t->dim, (t->is_bias ? m->weights[net]->var : m->weights[net]->mean) + stats, err);
                ++*count;
            }
            if (rc)
                return rc;
        }
    }
    return 0;
}

static int check_statistics(const struct ggn_model *m, struct base_err *err)
{
    for (int net = 0; net < GGN_NETS; net++)
        for (size_t i = 0; i < m->graph[net].n_stats; i++)
            if (m->weights[net]->var[i] < 0)
                return base_fail(err, BASE_EINVAL, "a running variance of the %s is negative", m->graph[net].name);
    return 0;
}

static int from_container(const struct ggn_container *c, struct ggn_model **model, struct base_err *err)
{
    struct ggn_description d = {0};
    struct ggn_model *m = NULL;
    int count = 0;
    int rc = ggn_description_parse(c->json, &d, err);
    if (!rc && !(m = create(&d.hyper, c->size / 2, err)))
        rc = err->code;
    if (!rc)
        rc = visit_all(&(struct visit){.from = c}, m, &count, err);
    if (!rc && count != c->n_entries)
        rc = base_fail(err, BASE_EINVAL, "%d tensors where the networks have %d", c->n_entries, count);
    if (!rc)
        rc = check_statistics(m, err);
    if (rc) {
        cJSON_Delete(d.provenance);
        ggn_model_destroy(m);
        return rc;
    }
    m->policy = d.policy;
    cJSON_Delete(m->provenance);
    m->provenance = d.provenance;
    for (int net = 0; net < GGN_NETS; net++)
        ggn_weights_pack(m->weights[net], NULL);
    *model = m;
    return 0;
}

int ggn_model_parse(const struct ggn_container *c, const char *name, struct ggn_model **model, struct base_err *err)
{
    struct base_err inner = {0};
    int rc = from_container(c, model, &inner);
    return rc ? base_fail(err, rc, "%s: %s", name, inner.text) : 0;
}

int ggn_model_load(const char *path, struct ggn_model **model, struct base_err *err)
{
    struct ggn_container c;
    int rc = ggn_container_read(&c, path, err);
    if (rc)
        return rc;
    rc = ggn_model_parse(&c, path, model, err);
    ggn_container_release(&c);
    return rc;
}

int ggn_model_save(const struct ggn_model *m, const char *path, enum ggn_type type, struct base_err *err)
{
    struct ggn_container c = {0};
    int count = 0;
    int rc = visit_all(&(struct visit){.to = &c, .type = type}, m, &count, err);
    if (!rc)
        c.json = ggn_description_print(&(struct ggn_description){m->hyper, m->policy, m->provenance});
    if (!rc && !c.json)
        rc = base_fail_nomem(err, "model file");
    if (!rc)
        rc = ggn_container_write(&c, path, err);
    ggn_container_release(&c);
    return rc;
}

int ggn_policy_set(struct ggn_model *model, const struct ggn_policy *policy, struct base_err *err)
{
    cJSON *object = cJSON_CreateObject();
    int rc = ggn_policy_check(policy, err), failed = !object;
    ggn_policy_put(object, policy, 1, &failed);
    if (!rc && failed)
        rc = base_fail_nomem(err, "model policy");
    if (rc) {
        cJSON_Delete(object);
        return rc;
    }
    cJSON_DeleteItemFromObjectCaseSensitive(model->provenance, "policy");
    base_json_item(model->provenance, "policy", object, &failed);
    if (failed)
        return base_fail_nomem(err, "model policy");
    model->policy = *policy;
    model->policy.ratio = policy->ratio > 1 ? policy->ratio : 1;
    model->policy.n_levels = 0;
    return 0;
}

int ggn_policy_of(const struct ggn_model *model, struct ggn_policy *policy, struct base_err *err)
{
    return ggn_policy_get(cJSON_GetObjectItemCaseSensitive(model->provenance, "policy"), model->policy, 1, policy, err);
}
