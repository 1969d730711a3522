/* Heater duties and everything that can switch them off. No board calls: the caller applies `duty`. */
#ifndef SAFETY_H
#define SAFETY_H

#include <stdbool.h>
#include <stdint.h>

#include "inputs.h"
#include "thermal.h"

#define CHANNELS THERMOMETERS

enum fault {
    FAULT_DEADMAN = 1,          /* no valid heater command for DEADMAN_MS while a heater was on */
    FAULT_TEMPERATURE = 2,      /* reported temperature above the limit */
    FAULT_HEAT = 4,             /* by the heat model a tube may be too hot, whatever is reported */
    FAULT_WATCHDOG = 8,         /* the firmware hung and was reset */
    FAULT_BROWN_OUT = 16,       /* the supply sagged and the board was reset */
    FAULT_SENSOR = 32,          /* temperature absent while heating, absurd, or heat does not show */
    FAULT_INTERNAL = 64,        /* output registers are not what they should be */
    FAULT_ANGLE = 128           /* while an angle is held: its potentiometer is open, shorted, or jumps */
};

struct limits {
    uint8_t duty;
    int16_t rise;               /* of the heat model above the room, 0.1 C */
    int16_t temperature;        /* reported, 0.1 C */
};

struct safety {
    struct limits limits;
    uint8_t duty[CHANNELS];             /* what the heaters must be given now */
    uint8_t faults;                     /* latched; any of them keeps the heaters off */
    uint16_t silence_ms;                /* since the last valid heater command */
    int16_t temperature[CHANNELS];      /* as reported last, 0.1 C or NO_READING */
    bool own[CHANNELS];                 /* a thermometer of the board's own reports it, not the host */
    bool sensed[CHANNELS];              /* that one has told something */
    uint16_t sensed_ms[CHANNELS];       /* since it did */
    bool fan;                           /* blows on the tubes */
    struct tube tube[CHANNELS];
    struct thermal thermal[CHANNELS];
};

/* What is known of the tubes when the board comes up. */
struct memory {
    struct tube tube[CHANNELS];         /* as calibrated; all zero where not */
    struct wiring wiring;               /* of the inputs */
    bool known;                         /* `thermal` has survived the reset */
    bool hot;                           /* where not: a tube may have been hot when the power went */
    struct thermal thermal[CHANNELS];
};

/* Start with heaters off; `faults` are those that the reset itself left behind. */
void safety_start(struct safety *s, uint8_t faults, const struct memory *memory);

/* A host's command: duties 0-255 and temperatures [0.1 C, NO_READING]. Feeds the dead-man.
 * With any fault latched or raised the duties become 0. */
void safety_command(struct safety *s, const uint8_t duty[CHANNELS], const int16_t temperature[CHANNELS]);

/* The command's two halves, for a controller on the board: temperatures feed the dead-man and are
 * checked as if both channels heated; duties are only set. */
void safety_report(struct safety *s, const int16_t temperature[CHANNELS]);
void safety_drive(struct safety *s, const uint8_t duty[CHANNELS]);

/* The board's own thermometer of a channel has told something [0.1 C, NO_READING]. */
void safety_sensed(struct safety *s, uint8_t channel, int16_t temperature);

/* Who reports a channel's temperature from now on: the board itself, or the host. */
void safety_own(struct safety *s, uint8_t channel, bool own);

/* One channel's duty by the old protocol, which reports no temperature. Feeds the dead-man. */
void safety_command_old(struct safety *s, uint8_t channel, uint8_t duty);

/* One millisecond has passed. */
void safety_tick(struct safety *s);

/* Heaters off, with nothing latched. */
void safety_off(struct safety *s);

/* Latch a fault: heaters off until it is cleared. */
void safety_fault(struct safety *s, uint8_t fault);

/* Clear latched faults; false, and nothing changes, while the cause of one lasts. */
bool safety_clear(struct safety *s);

/* Whether a tube may be warmer by a rise [0.1 C] than a cold one, which shows its room's temperature. */
bool safety_any_warm(const struct safety *s, int16_t rise);

/* Tighten limits: values looser than those in force change nothing. */
void safety_tighten(struct safety *s, const struct limits *limits);

#endif
