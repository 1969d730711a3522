#include "frame.h"

#include "crc16.h"

#define CHECK_LENGTH 5      /* `*HHHH` */

void frame_start(struct frame *f)
{
    f->length = 0;
    f->inside = false;
    f->too_long = false;
}

static int8_t hex(char c)
{
    if (c >= '0' && c <= '9') {
        return (int8_t)(c - '0');
    }
    if (c >= 'A' && c <= 'F') {
        return (int8_t)(c - 'A' + 10);
    }
    return -1;
}

static bool checked(struct frame *f)
{
    if (f->length > 0 && f->body[f->length - 1] == '\r') {
        f->length--;
    }
    if (f->too_long || f->length < CHECK_LENGTH) {
        return false;
    }
    uint8_t star = (uint8_t)(f->length - CHECK_LENGTH);
    uint16_t crc = crc16_update(CRC16_INITIAL, '>');
    uint16_t told = 0;
    for (uint8_t i = 0; i < star; i++) {
        crc = crc16_update(crc, (uint8_t)f->body[i]);
    }
    for (uint8_t i = (uint8_t)(star + 1); i < f->length; i++) {
        int8_t digit = hex(f->body[i]);
        if (digit < 0) {
            return false;
        }
        told = (uint16_t)(told << 4 | digit);
    }
    if (f->body[star] != '*' || told != crc) {
        return false;
    }
    f->body[star] = '\0';
    f->length = star;
    return true;
}

enum frame_event frame_byte(struct frame *f, uint8_t byte)
{
    if (byte == '>') {
        bool cut = f->inside;
        frame_start(f);
        f->inside = true;
        return cut ? FRAME_GARBLED : FRAME_PENDING;
    }
    if (!f->inside) {
        return FRAME_OUTSIDE;
    }
    if (byte == '\n') {
        bool whole = checked(f);
        f->inside = false;
        return whole ? FRAME_COMPLETE : FRAME_GARBLED;
    }
    if (f->length < FRAME_MAX) {
        f->body[f->length++] = (char)byte;
    } else {
        f->too_long = true;
    }
    return FRAME_PENDING;
}
