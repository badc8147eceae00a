/* Every allocation of loading, saving, inference and training set-up fails once: an error, no crash, no leak. */
#include "support/ggn_cmocka.h"

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include "baselines/baseline.h"
#include "baselines/lstm.h"
#include "model/inference.h"
#include "model/trainer.h"
#include "support/fail_alloc.h"

static const struct ggn_hyper hyper = {GGN_PRESET_LULL, 16, 16, 2, 1, 1, 1, 1, 0, 0};
static char path[] = "/tmp/ggn_oom.XXXXXX";

static int setup(void **state)
{
    int fd = mkstemp(path);
    (void)state;
    return fd < 0 ? -1 : close(fd);
}

static int teardown(void **state)
{
    (void)state;
    return unlink(path);
}

static int save_and_load(struct base_err *err)
{
    struct ggn_model *m = ggn_model_create(&hyper, err), *read = NULL;
    int rc = m ? ggn_model_save(m, path, GGN_F16, err) : BASE_ENOMEM;

    if (!rc)
        rc = ggn_model_load(path, &read, err);
    ggn_model_destroy(m);
    ggn_model_destroy(read);
    return rc;
}

static int judge(struct base_err *err)
{
    struct ggn_model *m = ggn_model_create(&hyper, err);
    struct ggn_inference *j = m ? ggn_inference_create(m, NULL, err) : NULL;
    int rc = j ? 0 : BASE_ENOMEM;

    ggn_inference_destroy(j);
    ggn_model_destroy(m);
    return rc;
}

static int baseline(struct base_err *err)
{
    struct ggn_baseline a, b = {0};
    struct ggn_baseline_reader *r = NULL;
    cJSON *from = cJSON_CreateObject();
    int rc = !from ? base_fail_nomem(err, "object") : ggn_baseline_init(&a, GGN_SVD_ENTROPY, 20, 20, 2, err);
    if (rc) {
        cJSON_Delete(from);
        return rc;
    }
    a.lstm = calloc(ggn_lstm_parameters(a.features), sizeof *a.lstm);
    rc = a.lstm ? ggn_baseline_save(&a, path, GGN_F16, from, err) : base_fail_nomem(err, "weights");
    if (!rc)
        rc = ggn_baseline_load(&b, path, GGN_SVD_ENTROPY, err);
    if (!rc && !(r = ggn_baseline_reader_create(&b, err)))
        rc = err->code;
    ggn_baseline_reader_destroy(r);
    ggn_baseline_release(&a);
    ggn_baseline_release(&b);
    cJSON_Delete(from);
    return rc;
}

static int train(struct base_err *err)
{
    struct ggn_train_options o = ggn_train_options_default(GGN_PRESET_LULL);
    o.batch = 1;
    struct ggn_trainer *t = ggn_trainer_create(&hyper, &o, NULL, err);
    int rc = t ? 0 : BASE_ENOMEM;

    ggn_trainer_destroy(t);
    return rc;
}

/* What may fail silently: the buffer of a file, the search for what an earlier writer left. */
static void fail_each(int (*fn)(struct base_err *), int least, int silent)
{
    int failures = 0;

    for (long k = 1; k < 2000; k++) {
        struct base_err err = {0};
        fail_arm(k);
        int rc = fn(&err);
        int happened = fail_disarm();
        if (happened && !rc && --silent < 0)
            fail_msg("allocation %ld failed and nothing was reported", k);
        if (happened) {
            assert_true(!rc || err.text[0] != '\0');
            failures++;
        } else {
            assert_int_equal(rc, 0);
            break;
        }
    }
    assert_in_range(failures, least, 1500);
}

static void test_files(void **state)
{
    (void)state;
    fail_each(save_and_load, 30, 3);
}

static void test_judge(void **state)
{
    (void)state;
    fail_each(judge, 8, 0);
}

static void test_train(void **state)
{
    (void)state;
    fail_each(train, 11, 0);
}

static void test_baseline(void **state)
{
    (void)state;
    fail_each(baseline, 12, 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_files), cmocka_unit_test(test_judge),
                                       cmocka_unit_test(test_train), cmocka_unit_test(test_baseline)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
