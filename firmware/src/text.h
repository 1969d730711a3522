/* Text to be sent, gathered while one event is handled; what does not fit is dropped whole. */
#ifndef TEXT_H
#define TEXT_H

#include <stdbool.h>
#include <stdint.h>

#define TEXT_SIZE 160

struct text {
    char data[TEXT_SIZE];
    uint8_t length;
    uint8_t frame;   /* where the frame being written starts */
    bool overflow;   /* the frame being written does not fit */
};

void text_clear(struct text *text);
void text_char(struct text *text, char c);
void text_word(struct text *text, const char *word);
/* A decimal number; with a blank before it. */
void text_digits(struct text *text, uint32_t number);
void text_number(struct text *text, uint32_t number);
/* A number that may be negative, or `-` in its place, with a blank before it. */
void text_signed(struct text *text, int32_t number);
void text_dash(struct text *text);

/* Frames: begin, words and numbers, end. The end writes checksum and LF, or takes the frame back. */
void text_begin(struct text *text, char start);
void text_end(struct text *text);

#endif
