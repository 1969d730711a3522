/* Gains of the angle controller (HOLD). `muscle-bayes tune` writes such a header; build with it by
 * `make firmware GAINS=path/to/gains.h`. These are no gains: HOLD is refused.
 *
 * Every period, in integers, divisions cutting towards zero (r, e, sum in 2^-16, 2^-8, 2^-8 counts):
 *   r   += (setpoint 2^16 - r) FILTER / 2^16          setpoint filter; 2^16: none
 *   e    = r / 2^8 - reading 2^8
 *   v    = (KP 2^8 e + KI sum) / 2^24 + feed(r / 2^16), feed straight between the entries of a table
 *   CASCADE 0: duties = BIAS + v for heater A, BIAS - v for heater B, each at least BIAS and at most 255
 *   CASCADE 1: the same in 0.1 C about BIAS, at most HOTTEST, is the temperature T* asked for, and
 *              duty = (HOLD (T* - ROOM) + HEAT (T* - T)) / 2^8, 0 to 255
 *   both: a duty is at most 255 (FADE_HIGH - T) / (FADE_HIGH - FADE_LOW), T the temperature as reported
 *   sum += e + BACK (what A is given more than B - v): back-calculation at limits
 * A reading that falls as muscle A contracts takes negative KP, KI and BACK. */
#ifndef GAINS_H
#define GAINS_H

#define GAINS_PERIOD_MS 30      /* 1 to 1000 */
#define GAINS_CASCADE 0         /* 1: v is a temperature [0.1 C]; 0: v is a duty */
#define GAINS_KP 0L             /* per count, times 2^8; -131071 to 131071 */
#define GAINS_KI 0L             /* per count and period, times 2^16; -131071 to 131071 */
#define GAINS_BACK 0L           /* 2^-8 counts per unit of v */
#define GAINS_FILTER 65536L     /* times 2^16 */
#define GAINS_BIAS 0            /* of both heaters, co-contraction; duty, or 0.1 C */
#define GAINS_FADE_LOW 20000    /* 0.1 C */
#define GAINS_FADE_HIGH 20001
#define GAINS_FEED_FIRST 0      /* setpoint of the table's first entry, counts */
#define GAINS_FEED_STEP 1       /* counts between entries */
#define GAINS_FEED {0, 0, 0, 0, 0, 0, 0, 0, 0}
#define GAINS_HOLD 0L           /* duty per 0.1 C, times 2^8 */
#define GAINS_HEAT 0L
#define GAINS_ROOM 250          /* 0.1 C */
#define GAINS_HOTTEST 900       /* 0.1 C */

#endif
