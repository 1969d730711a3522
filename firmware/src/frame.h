/* Frames of the line protocol: `>body*HHHH`, ended by LF, at most FRAME_MAX characters without it. */
#ifndef FRAME_H
#define FRAME_H

#include <stdbool.h>
#include <stdint.h>

#define FRAME_MAX 80

enum frame_event {
    FRAME_OUTSIDE,      /* the byte belongs to no frame */
    FRAME_PENDING,      /* a frame is under way */
    FRAME_COMPLETE,     /* `body` holds a frame whose checksum is right */
    FRAME_GARBLED       /* a frame ended that was damaged, cut short or too long */
};

struct frame {
    char body[FRAME_MAX + 1];   /* after FRAME_COMPLETE: zero-terminated, without `>` and checksum */
    uint8_t length;
    bool inside;
    bool too_long;
};

void frame_start(struct frame *f);

/* Take one byte. `>` begins a frame wherever it stands: no body holds one. */
enum frame_event frame_byte(struct frame *f, uint8_t byte);

#endif
