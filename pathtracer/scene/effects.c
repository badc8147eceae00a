#include "scene/effects.h"

#define PT_FX_TEXT(id, name, cost) {name, cost},
static const struct {
    const char *name, *cost;
} effects[PT_FX_COUNT] = {PT_EFFECTS(PT_FX_TEXT)};

const char *pt_effects_name(int i) { return effects[i].name; }

const char *pt_effects_cost(int i) { return effects[i].cost; }
