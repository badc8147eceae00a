/*
 * Selection of an emitter by what it probably sends to a point: a walk down the hierarchy of pt_light_tree, at each node to
 * a child in proportion to its importance (Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with Adaptive
 * Tree Splitting"). Lights at infinity stand beside the hierarchy.
 */
#include "shade/light.h"

#include <math.h>
#include <string.h>

/*
 * Four floats side by side, for what is worked out four times at once: GNU C's vectors (gcc, clang), which become the
 * machine's own where it has such and the same numbers anywhere else. + - * / act on each; comparisons give masks.
 */
typedef float pt_f4 __attribute__((vector_size(16)));
typedef int32_t pt_mask4 __attribute__((vector_size(16)));

static inline pt_f4 f4_splat(float x) { return (pt_f4){x, x, x, x}; }
static inline pt_f4 f4_load(const float *x)
{
    pt_f4 v;
    memcpy(&v, x, sizeof v);
    return v;
}
static inline pt_mask4 f4_load_mask(const int32_t *x)
{
    pt_mask4 m;
    memcpy(&m, x, sizeof m);
    return m;
}
/* yes where the mask is set, no elsewhere */
static inline pt_f4 f4_select(pt_mask4 mask, pt_f4 yes, pt_f4 no)
{
    return (pt_f4)((mask & (pt_mask4)yes) | (~mask & (pt_mask4)no));
}
static inline pt_f4 f4_max(pt_f4 a, pt_f4 b) { return f4_select(a > b, a, b); }
static inline pt_f4 f4_abs(pt_f4 a) { return (pt_f4)((pt_mask4)a & 0x7fffffff); }
static inline pt_f4 f4_sqrt(pt_f4 a) { return (pt_f4){sqrtf(a[0]), sqrtf(a[1]), sqrtf(a[2]), sqrtf(a[3])}; }

/* Added to cosines that decide whether anything arrives at all: their rounding must not cut off what does. sqrt(1 - c²) of a
 * float is off by up to the square root of its rounding, 3e-4. */
#define SLACK 1e-3f

/* Part of a node's importance that is handed out by intensity alone: what is near may be hidden, and its share then lost. */
#define DEFENSIVE 0.1f

/* An angle in [0, π] of each child. */
struct angle {
    pt_f4 cosine, sine;
};

static inline struct angle angle_of(pt_f4 cosine)
{
    return (struct angle){cosine, f4_sqrt(f4_max(f4_splat(1.0f) - cosine * cosine, f4_splat(0.0f)))};
}

/* max(0, a - b) */
static inline struct angle less(struct angle a, struct angle b)
{
    pt_mask4 within = a.cosine > b.cosine;
    return (struct angle){f4_select(within, f4_splat(1.0f), a.cosine * b.cosine + a.sine * b.sine),
                          f4_select(within, f4_splat(0.0f), a.sine * b.cosine - a.cosine * b.sine)};
}

/*
 * Importance of the children: intensity · cos θ' · cos θi' / d². θ' is the least angle between a normal and the way to the
 * receiver, θi' the least between the receiver's normal and the way to the light, over all of the child's sphere; both are
 * 0 inside of it. Within a sphere d is its radius. Of children that can send something, DEFENSIVE is shared by intensity.
 */
static inline pt_f4 weigh(const struct pt_light_node *n, const struct pt_receiver *at)
{
    const pt_f4 one = f4_splat(1.0f), slack = f4_splat(SLACK);
    pt_f4 radius = f4_load(n->radius), x = f4_load(n->centre_x) - at->p.x, y = f4_load(n->centre_y) - at->p.y,
          z = f4_load(n->centre_z) - at->p.z;
    pt_f4 d2 = x * x + y * y + z * z, r2 = radius * radius;
    pt_mask4 outside = d2 > r2;
    d2 = f4_select(outside, d2, r2);
    pt_f4 inv_d = one / f4_sqrt(d2), sin_sphere = radius * inv_d;
    struct angle sphere = {angle_of(sin_sphere).sine, sin_sphere};
    pt_f4 cos_light = -(f4_load(n->axis_x) * x + f4_load(n->axis_y) * y + f4_load(n->axis_z) * z) * inv_d;
    pt_f4 cos_at = (at->n.x * x + at->n.y * y + at->n.z * z) * inv_d;
    cos_light = f4_select(f4_load_mask(n->two_sided), f4_abs(cos_light), cos_light);
    if (at->kind == PT_RECEIVER_BOTH_SIDES)
        cos_at = f4_abs(cos_at);
    struct angle normals = {f4_load(n->cos_normals), f4_load(n->sin_normals)};
    pt_f4 emitted = less(less(angle_of(cos_light), normals), sphere).cosine + slack;
    emitted = f4_select(emitted > f4_load(n->cos_emission), emitted, f4_splat(0.0f));
    pt_f4 received = one;
    if (at->kind != PT_RECEIVER_VOLUME)
        received = f4_max(less(angle_of(cos_at), sphere).cosine + slack, f4_splat(0.0f));
    pt_f4 intensity = f4_load(n->intensity), w = intensity * inv_d * inv_d * f4_select(outside, emitted * received, one);
    float sum = (w[0] + w[1]) + (w[2] + w[3]);
    return w + f4_select(w > f4_splat(0.0f), DEFENSIVE * sum * intensity, f4_splat(0.0f));
}

static int32_t pick_far(const struct pt_light_tree *tree, float u, float *pmf)
{
    int32_t i = (int32_t)(u * (float)tree->far_count);
    *pmf = (1.0f - tree->share) / (float)tree->far_count;
    return tree->far[i < tree->far_count ? i : tree->far_count - 1];
}

int32_t pt_light_tree_pick(const struct pt_scene *scene, const struct pt_receiver *at, float u, float *pmf)
{
    const struct pt_light_tree *tree = scene->light_tree;
    if (u >= tree->share)
        return pick_far(tree, (u - tree->share) / (1.0f - tree->share), pmf);
    *pmf = tree->share;
    u /= tree->share;
    for (int32_t i = 0; i >= 0;) {
        const struct pt_light_node *n = &tree->nodes[i];
        pt_f4 w = weigh(n, at);
        float sum1 = w[0] + w[1], sum2 = sum1 + w[2], sum = sum2 + w[3], x = u * sum;
        if (!(sum > 0.0f))
            return -1;
        const float before[PT_LIGHT_FAN] = {0.0f, w[0], sum1, sum2};
        int k = (x >= w[0]) + (x >= sum1) + (x >= sum2);
        while (k > 0 && !(w[k] > 0.0f)) /* u·sum may be rounded up to the sum */
            k--;
        u = fminf((x - before[k]) / w[k], 0x1.fffffep-1f);
        *pmf *= w[k] / sum;
        i = n->child[k];
        if (i < 0)
            return ~i;
    }
    return -1;
}

float pt_light_tree_pmf(const struct pt_scene *scene, const struct pt_receiver *at, int32_t emitter)
{
    const struct pt_light_tree *tree = scene->light_tree;
    float pmf = tree->share;
    int32_t place = tree->places[emitter];
    if (place < 0)
        return 0.0f;
    for (; place >= 0 && pmf > 0.0f; place = tree->nodes[place / PT_LIGHT_FAN].parent) {
        pt_f4 w = weigh(&tree->nodes[place / PT_LIGHT_FAN], at);
        float sum = w[0] + w[1] + w[2] + w[3];
        pmf *= sum > 0.0f ? w[place % PT_LIGHT_FAN] / sum : 0.0f;
    }
    return pmf;
}
