/* Gives the library room for one number too few: a library checked by AddressSanitizer must stop here, or it checks nothing. */

#include "psidpd.h"

#include <stdlib.h>

static const char *const model_text =
    "title = \"soft\"\n"
    "species = [\"F\"]\n"
    "[[pair]]\n"
    "between = [\"F\", \"F\"]\n"
    "form = \"soft\"\n"
    "strength = 25.0\n"
    "range = 1.0\n";

int main(void)
{
    double x[6] = {0.0, 0.0, 0.0, 0.5, 0.5, 0.5};
    double *force = malloc(5 * sizeof *force);
    int32_t tag[2] = {1, 2}, kind[2] = {0, 0};
    psidpd_model *model = NULL;
    psidpd_engine *engine = NULL;
    psidpd_request request = {0};
    request.particles.owned = 2;
    request.particles.all = 2;
    request.particles.x = x;
    request.particles.tag = tag;
    request.particles.kind = kind;
    if (psidpd_model_parse("soft", model_text, &model)) return 3;
    if (psidpd_engine_new(model, 1.0, NULL, &engine)) return 3;
    if (psidpd_engine_first(engine, NULL, NULL, 1, &request)) return 3;
    if (psidpd_engine_second(engine, &request, force, NULL)) return 3;
    return 0;
}
