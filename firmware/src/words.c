#include "words.h"

#include <stddef.h>

#define DIGITS_MAX 9

bool words_take(struct words *w, const char **word, uint8_t *length)
{
    const char *c = w->next;
    if (c == NULL) {
        return false;
    }
    *word = c;
    while (*c != '\0' && *c != ' ') {
        c++;
    }
    *length = (uint8_t)(c - *word);
    w->next = *c == ' ' ? c + 1 : NULL;
    return *length > 0;
}

int32_t words_number(struct words *w, int32_t low, int32_t high, bool *ok, bool *inside)
{
    const char *word;
    uint8_t length;
    int32_t value = 0;
    if (!words_take(w, &word, &length)) {
        *ok = false;
        return 0;
    }
    bool negative = *word == '-';
    uint8_t first = negative ? 1 : 0;
    if (length == first || length - first > DIGITS_MAX) {
        *ok = false;
        return 0;
    }
    for (uint8_t i = first; i < length; i++) {
        if (word[i] < '0' || word[i] > '9') {
            *ok = false;
            return 0;
        }
        value = 10 * value + (word[i] - '0');
    }
    if (negative) {
        value = -value;
    }
    if (value < low || value > high) {
        *inside = false;
    }
    return value;
}

bool words_end(const struct words *w)
{
    return w->next == NULL;
}

bool words_equal(const char *word, uint8_t length, const char *other)
{
    for (uint8_t i = 0; i < length; i++) {
        if (other[i] != word[i] || other[i] == '\0') {
            return false;
        }
    }
    return other[length] == '\0';
}
