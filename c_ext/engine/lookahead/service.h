/* Contour look-ahead service (FCT-C40 section 5.2): one function for the cyclic
 * and the immediate mode. */
#ifndef ENGINE_LOOKAHEAD_SERVICE_H
#define ENGINE_LOOKAHEAD_SERVICE_H
#include "engine/state/state.h"

double max_dist_prog_start(struct engine *engine);

/* Serve a pending request; returns 1 if there was one. */
int serve_request(struct engine *engine);
#endif
