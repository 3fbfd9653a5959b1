/* Whether operator or PLC have changed anything since the last commit.
 *
 * Pumped on one thread without jerk much is committed at once as long as they
 * have not: each commit has its price, mostly what it has to fetch into the
 * caches. What has changed takes back all that has not begun.
 */
#ifndef ENGINE_PLAN_ORDERS_SEEN_H
#define ENGINE_PLAN_ORDERS_SEEN_H
#include "engine/state/state.h"

/* Where orders have changed behind a far commit: takes back what has not begun,
 * unless no more is ahead of GEO than any commit reaches. */
void recall_for_orders(struct engine *engine);

/* How far the commit that begins may reach. */
void choose_reach(struct engine *engine);
#endif
