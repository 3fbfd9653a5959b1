/* A planner that is late: the path brakes or stands, and nobody has asked for
 * it. */
#ifndef LATENESS_H
#define LATENESS_H
struct engine;

/* Behind the motion of a cycle. */
void note_lateness(struct engine *engine);
#endif
