#include "plugin/criteria.h"

GP_ENTRY(&ggn_plugin_svd_entropy, &ggn_plugin_attributes, &ggn_plugin_noise_mask)
