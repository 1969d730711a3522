#include "text.h"

#include "crc16.h"

void text_clear(struct text *text)
{
    text->length = 0;
    text->frame = 0;
    text->overflow = false;
}

void text_char(struct text *text, char c)
{
    if (text->length < TEXT_SIZE) {
        text->data[text->length++] = c;
    } else {
        text->overflow = true;
    }
}

void text_word(struct text *text, const char *word)
{
    while (*word) {
        text_char(text, *word++);
    }
}

void text_digits(struct text *text, uint32_t number)
{
    char reversed[10];
    uint8_t count = 0;
    do {
        reversed[count++] = (char)('0' + number % 10u);
        number /= 10u;
    } while (number);
    while (count) {
        text_char(text, reversed[--count]);
    }
}

void text_number(struct text *text, uint32_t number)
{
    text_char(text, ' ');
    text_digits(text, number);
}

void text_begin(struct text *text, char start)
{
    text->frame = text->length;
    text->overflow = false;
    text_char(text, start);
}

void text_end(struct text *text)
{
    static const char hex[] = "0123456789ABCDEF";
    uint16_t crc = CRC16_INITIAL;
    for (uint8_t i = text->frame; i < text->length; i++) {
        crc = crc16_update(crc, (uint8_t)text->data[i]);
    }
    text_char(text, '*');
    for (int8_t shift = 12; shift >= 0; shift = (int8_t)(shift - 4)) {
        text_char(text, hex[(crc >> shift) & 0xFu]);
    }
    text_char(text, '\n');
    if (text->overflow) {
        text->length = text->frame;
    }
}
