/* Gains of the angle controller (HOLD). `muscle-bayes tune` writes such a header; build with it by
 * `make firmware GAINS=path/to/gains.h`. These are no gains: HOLD is refused.
 *
 * Every period, with e = setpoint - reading in counts of analog input 0:
 *   u = (GAINS_KP e) / 2^8 + (GAINS_KI sum(e)) / 2^16, clamped to +-255
 *   heater A = GAINS_BIAS + u where u > 0, heater B = GAINS_BIAS - u where u < 0, both at most 255.
 * A reading that falls as muscle A contracts takes negative gains. */
#ifndef GAINS_H
#define GAINS_H

#define GAINS_PERIOD_MS 30      /* 1 to 1000 */
#define GAINS_KP 0L             /* duty per count, times 2^8; -32768 to 32767 */
#define GAINS_KI 0L             /* duty per count and period, times 2^16; -32768 to 32767 */
#define GAINS_BIAS 0            /* duty of both heaters, co-contraction; 0 to 255 */

#endif
