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

/* By subtraction: a 32-bit division costs an AVR 40 us, and a sample has 20 digits. */
void text_digits(struct text *text, uint32_t number)
{
    static const uint32_t powers[] = {1000000000, 100000000, 10000000, 1000000, 100000,
                                      10000,      1000,      100,      10,      1};
    bool begun = false;
    for (uint8_t i = 0; i < sizeof powers / sizeof *powers; i++) {
        char digit = '0';
        while (number >= powers[i]) {
            number -= powers[i];
            digit++;
        }
        begun = begun || digit != '0' || powers[i] == 1;
        if (begun) {
            text_char(text, digit);
        }
    }
}

void text_number(struct text *text, uint32_t number)
{
    text_char(text, ' ');
    text_digits(text, number);
}

void text_signed(struct text *text, int32_t number)
{
    text_char(text, ' ');
    if (number < 0) {
        text_char(text, '-');
    }
    text_digits(text, number < 0 ? 0u - (uint32_t)number : (uint32_t)number);
}

void text_dash(struct text *text)
{
    text_word(text, " -");
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
